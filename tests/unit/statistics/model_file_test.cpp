#include "reconstruction/statistics/model_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>

#include "core/file.h"
#include "reconstruction/statistics/hdf5_group.h"
#include "tests/support/process.h"
#include "tests/support/temporary_folder.h"
#include "tests/unit/statistics/small_face_model.h"

namespace skullstation {
namespace {

using skullstation::testing::small_face_model;
using ::testing::HasSubstr;

testing::ProcessResult run(const std::vector<std::string>& command) {
  return testing::Process(command).wait();
}

std::string encoded() { return encode_model(small_face_model()).value(); }

TEST(ModelFile, GivesTheModelBack) {
  const FaceModel model = small_face_model();
  const auto back = decode_model(encode_model(model).value(), "model.h5");
  ASSERT_TRUE(back) << back.error().message();
  EXPECT_EQ(back->skull_template.vertices, model.skull_template.vertices);
  EXPECT_EQ(back->skull_template.tetrahedra, model.skull_template.tetrahedra);
  EXPECT_EQ(back->skull_template.boundary, model.skull_template.boundary);
  EXPECT_EQ(back->skull_template.region, model.skull_template.region);
  EXPECT_EQ(back->skull_template.outer, model.skull_template.outer);
  ASSERT_EQ(back->skull_template.landmarks.size(), 2U);
  EXPECT_EQ(back->skull_template.landmarks[1].name, "gonion left");
  EXPECT_EQ(back->skull_template.landmarks[0].place.weights,
            model.skull_template.landmarks[0].place.weights);
  EXPECT_EQ(back->head_template.region, model.head_template.region);
  EXPECT_EQ(back->head_template.mirror, model.head_template.mirror);
  EXPECT_EQ(back->head_template.triangles, model.head_template.triangles);
  EXPECT_EQ(back->tissue.count, model.tissue.count);
  EXPECT_EQ(back->tissue.modelled, model.tissue.modelled);
  EXPECT_EQ(back->joint.names, model.joint.names);
  EXPECT_EQ(back->joint.covariance, model.joint.covariance);
  EXPECT_EQ(back->joint.blocks, model.joint.blocks);
  EXPECT_EQ(back->joint.penalties, model.joint.penalties);
  EXPECT_EQ(back->joint.subjects, 8);
  ASSERT_EQ(back->skin_directions.size(), 1U);
  EXPECT_EQ(back->skin_directions[0].direction, model.skin_directions[0].direction);
  ASSERT_EQ(back->bands.size(), 1U);
  EXPECT_EQ(back->bands[0].region, "nose");
  EXPECT_EQ(back->bands[0].factor, 1.4);
  EXPECT_EQ(back->provenance, model.provenance);
}

TEST(ModelFile, ShapesComeBackToAFiftiethOfAMillimetre) {
  const FaceModel model = small_face_model();
  const FaceModel back = decode_model(encode_model(model).value(), "model.h5").value();
  const Eigen::VectorXd far{{3.0, -3.0}};
  EXPECT_LT((shape_at(back.skull, far) - shape_at(model.skull, far)).rowwise().norm().maxCoeff(),
            0.02 * std::sqrt(2.0));
  EXPECT_LT((shape_at(back.head, far) - shape_at(model.head, far)).rowwise().norm().maxCoeff(),
            0.02 * std::sqrt(2.0));
  const Eigen::VectorXd thick{{2.0}};
  EXPECT_LT((tissue_at(back.tissue, thick) - tissue_at(model.tissue, thick)).cwiseAbs().maxCoeff(),
            1e-3);
}

TEST(ModelFile, IsTheSameBytesForTheSameModel) { EXPECT_EQ(encoded(), encoded()); }

TEST(ModelFile, ItsPartsAreStatismoModels) {
  const FaceModel model = small_face_model();
  const auto head = decode_statismo(encoded(), "model.h5", "/head");
  ASSERT_TRUE(head) << head.error().message();
  EXPECT_EQ(head->triangles, model.head_template.triangles);
  EXPECT_EQ(head->model.mode_count(), 2);
}

TEST(ModelFile, OpensInPythonAsStatismoHasIt) {
  const testing::TemporaryFolder folder;
  const auto path = folder.path() / "model.h5";
  ASSERT_TRUE(write_file_durably(path, encoded()));
  if (run({"/usr/bin/python3", "-c", "import h5py, numpy"}).exit_code != 0) {
    GTEST_SKIP() << "python3-h5py is not installed";
  }
  // A member 1.5 SD along the first mode, as a reader of Statismo files makes it.
  const auto script = folder.path() / "check.py";
  const Points3 expected = shape_at(small_face_model().skull, Eigen::VectorXd{{1.5}});
  ASSERT_TRUE(write_file_durably(script, R"(
import h5py, numpy, sys
f = h5py.File(sys.argv[1], "r")
for group in ("skull", "head"):
    g = f[group]
    n = g["representer/points"].shape[1]
    assert g["representer/points"].shape[0] == 3 and g["representer/cells"].shape[0] == 3
    assert g["representer"].attrs["datasetType"] in ("POLYGON_MESH", b"POLYGON_MESH")
    assert g["model/mean"].shape == (3 * n,)
    assert g["model/pcaBasis"].shape == (3 * n, g["model/pcaVariance"].shape[0])
    assert g["model/noiseVariance"].shape == ()
    assert g["version/majorVersion"][()] == 0
g = f["skull/model"]
x = g["mean"][:] + 1.5 * numpy.sqrt(g["pcaVariance"][0]) * g["pcaBasis"][:, 0]
print("%.4f %.4f %.4f" % tuple(x[30:33]))
)"));
  const testing::ProcessResult result = run({"/usr/bin/python3", script.string(), path.string()});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  Eigen::Vector3d vertex;
  std::istringstream(result.out) >> vertex.x() >> vertex.y() >> vertex.z();
  EXPECT_LT((vertex - expected.row(10).transpose()).norm(), 0.02);
}

TEST(ModelFile, RefusesWhatIsNoModel) {
  const auto error = [](std::string bytes) {
    return decode_model(std::move(bytes), "model.h5").error();
  };
  EXPECT_THAT(error("").message(), HasSubstr("not a whole HDF5 file"));
  EXPECT_THAT(error("ply\nformat ascii 1.0\n").message(), HasSubstr("not a whole HDF5 file"));
  Hdf5Writer foreign;
  foreign.text("/something", "else");
  EXPECT_THAT(error(foreign.finish().value()).message(), HasSubstr("no model of ours"));
  Hdf5Writer older;
  older.attribute("/", "format", "skullstation-model/0");
  EXPECT_THAT(error(older.finish().value()).message(), HasSubstr("\"skullstation-model/0\""));
  Hdf5Writer hollow;
  hollow.attribute("/", "format", "skullstation-model/1");
  EXPECT_THAT(error(hollow.finish().value()).message(), HasSubstr("/skull/model/mean: is missing"));
}

TEST(ModelFile, CutOffAnywhereGivesAnErrorNeverACrash) {
  const std::string whole = encoded();
  for (std::size_t length = 0; length < whole.size(); length += whole.size() / 61) {
    const auto model = decode_model(whole.substr(0, length), "model.h5");
    ASSERT_FALSE(model) << length;
    EXPECT_EQ(model.error().kind, ErrorKind::bad_input);
  }
}

TEST(ModelFile, UnsoundModelsAreNotWritten) {
  FaceModel torn = small_face_model();
  torn.tissue.log_mean.conservativeResize(5);
  EXPECT_THAT(encode_model(torn).error().message(), HasSubstr("not of one length"));
  torn = small_face_model();
  torn.head.mean.conservativeResize(6);
  torn.head.modes.conservativeResize(6, 2);
  EXPECT_THAT(encode_model(torn).error().message(), HasSubstr("its head model has 2 vertices"));
}

TEST(Statismo, ReadsAModelMadeByOthers) {
  const std::filesystem::path file = testing::real_data_folder() / "head-ict" / "ict_head.h5";
  if (!std::filesystem::exists(file)) GTEST_SKIP() << file << " is not there";
  const auto head = decode_statismo(read_file(file).value(), "ict_head.h5");
  ASSERT_TRUE(head) << head.error().message();
  EXPECT_EQ(head->model.vertex_count(), 11248);
  EXPECT_EQ(head->model.mode_count(), 60);
  EXPECT_EQ(head->triangles.rows(), 22288);
  EXPECT_EQ(decode_statismo(encoded(), "model.h5", "/nothing").error().kind, ErrorKind::bad_input);
}

}  // namespace
}  // namespace skullstation
