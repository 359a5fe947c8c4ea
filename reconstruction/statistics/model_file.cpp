#include "reconstruction/statistics/model_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "reconstruction/statistics/hdf5_group.h"

namespace skullstation {

namespace {

using Eigen::Index;

constexpr const char* format_name = "skullstation-model/1";
/// Modes are stored so finely that a shape 3 SD away moves by less than this [mm].
constexpr double mode_precision_mm = 0.02;

template <class Derived>
NumberTable as_table(const Eigen::DenseBase<Derived>& matrix) {
  NumberTable numbers;
  numbers.rows = matrix.rows();
  numbers.columns = matrix.cols();
  numbers.flat = Derived::ColsAtCompileTime == 1;
  numbers.values.reserve(static_cast<std::size_t>(matrix.size()));
  for (Index i = 0; i < matrix.rows(); ++i) {
    for (Index j = 0; j < matrix.cols(); ++j) {
      numbers.values.push_back(static_cast<double>(matrix(i, j)));
    }
  }
  return numbers;
}

template <class Range, class Convert>
NumberTable as_column(const Range& range, const Convert& convert) {
  NumberTable numbers;
  for (const auto& value : range) numbers.values.push_back(static_cast<double>(convert(value)));
  numbers.rows = static_cast<Index>(numbers.values.size());
  return numbers;
}

void write_shape_model(Hdf5Writer& file, const std::string& group, const ShapeModel& model,
                       const Triangles& surface) {
  const Points3 mean = unflattened(model.mean);
  file.attribute(group + "/representer", "name", "statismo-mesh");
  file.attribute(group + "/representer", "datasetType", "POLYGON_MESH");
  file.table(group + "/representer/points", as_table(mean.transpose()), StoredNumber::float32);
  file.table(group + "/representer/cells", as_table(surface.transpose()), StoredNumber::int32);
  file.table(group + "/model/mean", as_table(model.mean), StoredNumber::float32);
  const double largest_sd = std::sqrt(model.variances.maxCoeff());
  const int decimals =
      static_cast<int>(std::ceil(std::log10(3.0 * largest_sd / mode_precision_mm)));
  file.table(group + "/model/pcaBasis", as_table(model.modes), StoredNumber::rounded, decimals);
  file.table(group + "/model/pcaVariance", as_table(model.variances), StoredNumber::float32);
  file.scalar(group + "/model/noiseVariance", model.noise_variance, StoredNumber::float32);
  file.scalar(group + "/version/majorVersion", 0, StoredNumber::int32);
  file.scalar(group + "/version/minorVersion", 9, StoredNumber::int32);
  file.attribute(group + "/modelinfo", "units", "mm, LPS axes");
}

void write_landmarks(Hdf5Writer& file, const std::string& group,
                     const std::vector<TemplateLandmark>& landmarks) {
  std::vector<std::string> names;
  Eigen::Matrix<double, Eigen::Dynamic, 3> corners(landmarks.size(), 3);
  Eigen::Matrix<double, Eigen::Dynamic, 3> weights(landmarks.size(), 3);
  for (std::size_t i = 0; i < landmarks.size(); ++i) {
    names.push_back(landmarks[i].name);
    corners.row(static_cast<Index>(i)) = landmarks[i].place.corners.cast<double>().transpose();
    weights.row(static_cast<Index>(i)) = landmarks[i].place.weights.transpose();
  }
  file.texts(group + "/names", names);
  file.table(group + "/corners", as_table(corners), StoredNumber::int32);
  file.table(group + "/weights", as_table(weights), StoredNumber::float64);
}

/// Reads tables and remembers the first failure, so that a reader reads like a list.
class ModelReader {
 public:
  explicit ModelReader(const Hdf5Reader& file) : file_(file) {}

  const std::optional<Error>& error() const { return error_; }
  void refuse(const std::string& path, const std::string& what) {
    if (!error_) error_ = Error{ErrorKind::bad_input, path, what, "build the model again"};
  }

  NumberTable table(const std::string& path) { return taken(file_.table(path)); }
  double scalar(const std::string& path) { return taken(file_.scalar(path)); }
  std::string text(const std::string& path) { return taken(file_.text(path)); }
  std::vector<std::string> texts(const std::string& path) { return taken(file_.texts(path)); }

  Eigen::MatrixXd matrix(const std::string& path) {
    const NumberTable numbers = table(path);
    return Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>(
        numbers.values.data(), numbers.rows, numbers.columns);
  }
  Eigen::VectorXd vector(const std::string& path) {
    const NumberTable numbers = table(path);
    return Eigen::Map<const Eigen::VectorXd>(numbers.values.data(),
                                             static_cast<Index>(numbers.values.size()));
  }
  /// #rows x `columns`; whole numbers if the target's are.
  template <class Matrix>
  Matrix of_width(const std::string& path, Index columns) {
    const Eigen::MatrixXd values = matrix(path);
    if (values.size() == 0) return Matrix(0, columns);  // none there, or already refused
    if (values.cols() != columns) {
      refuse(path, fmt::format("has {} columns instead of {}", values.cols(), columns));
      return Matrix(0, columns);
    }
    return values.cast<typename Matrix::Scalar>();
  }
  /// Statismo lays triangles out as 3 x #F.
  Triangles cells(const std::string& path) {
    const Eigen::MatrixXd corners = matrix(path);
    if (corners.rows() != 3) {
      refuse(path, "does not hold triangles");
      return {};
    }
    return corners.transpose().cast<int>();
  }
  template <class Value>
  std::vector<Value> values(const std::string& path, double below) {
    std::vector<Value> result;
    for (const double value : table(path).values) {
      if (!(value >= 0.0 && value < below)) {
        refuse(path, fmt::format("holds {}, which is out of range", value));
        return {};
      }
      result.push_back(static_cast<Value>(value));
    }
    return result;
  }

 private:
  template <class T>
  T taken(Result<T> result) {
    if (result) return *std::move(result);
    if (!error_) error_ = result.error();
    return T{};
  }

  const Hdf5Reader& file_;
  std::optional<Error> error_;
};

ShapeModel read_shape_model(ModelReader& file, const std::string& group) {
  ShapeModel model;
  model.mean = file.vector(group + "/model/mean");
  model.modes = file.matrix(group + "/model/pcaBasis");
  model.variances = file.vector(group + "/model/pcaVariance");
  model.noise_variance = file.scalar(group + "/model/noiseVariance");
  return model;
}

std::vector<TemplateLandmark> read_landmarks(ModelReader& file, const std::string& group) {
  const std::vector<std::string> names = file.texts(group + "/names");
  const auto corners = file.of_width<Eigen::Matrix<int, Eigen::Dynamic, 3>>(group + "/corners", 3);
  const auto weights =
      file.of_width<Eigen::Matrix<double, Eigen::Dynamic, 3>>(group + "/weights", 3);
  std::vector<TemplateLandmark> landmarks;
  const auto count = static_cast<Index>(names.size());
  if (corners.rows() != count || weights.rows() != count) {
    file.refuse(group, "has names, corners and weights of different lengths");
    return landmarks;
  }
  for (Index i = 0; i < count; ++i) {
    landmarks.push_back({names[static_cast<std::size_t>(i)],
                         {corners.row(i).transpose(), weights.row(i).transpose()}});
  }
  return landmarks;
}

void write_skull_template(Hdf5Writer& file, const SkullTemplate& skull) {
  const auto plain = [](const auto& value) { return value; };
  file.table("/skull/template", as_table(skull.vertices), StoredNumber::float64);
  file.table("/skull/tetrahedra", as_table(skull.tetrahedra), StoredNumber::int32);
  file.table("/skull/region",
             as_column(skull.region, [](SkullRegion r) { return static_cast<int>(r); }),
             StoredNumber::uint8);
  file.table("/skull/outer", as_column(skull.outer, plain), StoredNumber::uint8);
  Eigen::Matrix<double, Eigen::Dynamic, 3> corners(skull.mirror.size(), 3);
  Eigen::Matrix<double, Eigen::Dynamic, 3> weights(skull.mirror.size(), 3);
  for (std::size_t i = 0; i < skull.mirror.size(); ++i) {
    corners.row(static_cast<Index>(i)) = skull.mirror[i].corners.cast<double>().transpose();
    weights.row(static_cast<Index>(i)) = skull.mirror[i].weights.transpose();
  }
  file.table("/skull/mirror/corners", as_table(corners), StoredNumber::int32);
  file.table("/skull/mirror/weights", as_table(weights), StoredNumber::rounded, 4);
  write_landmarks(file, "/skull/landmarks", skull.landmarks);
}

SkullTemplate read_skull_template(ModelReader& file) {
  SkullTemplate skull;
  skull.vertices = file.of_width<Points3>("/skull/template", 3);
  skull.tetrahedra = file.of_width<Tetrahedra>("/skull/tetrahedra", 4);
  skull.boundary = file.cells("/skull/representer/cells");
  skull.region = file.values<SkullRegion>("/skull/region", kSkullRegionCount);
  skull.outer = file.values<bool>("/skull/outer", 2);
  skull.boundary_count = static_cast<int>(skull.outer.size());
  const auto corners =
      file.of_width<Eigen::Matrix<int, Eigen::Dynamic, 3>>("/skull/mirror/corners", 3);
  const auto weights =
      file.of_width<Eigen::Matrix<double, Eigen::Dynamic, 3>>("/skull/mirror/weights", 3);
  if (corners.rows() != weights.rows()) {
    file.refuse("/skull/mirror", "has corners and weights of different lengths");
    return skull;
  }
  for (Index i = 0; i < corners.rows(); ++i) {
    skull.mirror.push_back({corners.row(i).transpose(), weights.row(i).transpose()});
  }
  skull.landmarks = read_landmarks(file, "/skull/landmarks");
  return skull;
}

void write_head_template(Hdf5Writer& file, const HeadTemplate& head) {
  const auto plain = [](const auto& value) { return value; };
  file.table("/head/template", as_table(head.vertices), StoredNumber::float64);
  file.table("/head/region",
             as_column(head.region, [](HeadRegion r) { return static_cast<int>(r); }),
             StoredNumber::uint8);
  file.table("/head/mirror", as_column(head.mirror, plain), StoredNumber::int32);
  file.table("/head/data_weight", as_column(head.data_weight, plain), StoredNumber::float32);
  write_landmarks(file, "/head/landmarks", head.landmarks);
}

HeadTemplate read_head_template(ModelReader& file) {
  HeadTemplate head;
  head.vertices = file.of_width<Points3>("/head/template", 3);
  head.triangles = file.cells("/head/representer/cells");
  head.region = file.values<HeadRegion>("/head/region", kHeadRegionCount);
  head.mirror = file.values<int>("/head/mirror", static_cast<double>(head.vertices.rows()));
  head.data_weight = file.values<double>("/head/data_weight", 1.0 + 1e-6);
  head.landmarks = read_landmarks(file, "/head/landmarks");
  return head;
}

void write_tissue(Hdf5Writer& file, const TissueModel& tissue) {
  file.table("/tissue/count", as_table(tissue.count), StoredNumber::int32);
  file.table("/tissue/mean", as_table(tissue.mean_mm), StoredNumber::float32);
  file.table("/tissue/sd", as_table(tissue.sd_mm), StoredNumber::float32);
  file.table("/tissue/modelled", as_column(tissue.modelled, [](bool value) { return value; }),
             StoredNumber::uint8);
  file.table("/tissue/log_mean", as_table(tissue.log_mean), StoredNumber::float32);
  file.table("/tissue/modes", as_table(tissue.modes), StoredNumber::rounded, 5);
  file.table("/tissue/noise_sd", as_table(tissue.noise_sd), StoredNumber::float32);
}

TissueModel read_tissue(ModelReader& file) {
  TissueModel tissue;
  tissue.count = file.vector("/tissue/count").cast<int>();
  tissue.mean_mm = file.vector("/tissue/mean");
  tissue.sd_mm = file.vector("/tissue/sd");
  tissue.modelled = file.values<bool>("/tissue/modelled", 2);
  tissue.log_mean = file.vector("/tissue/log_mean");
  tissue.modes = file.matrix("/tissue/modes");
  tissue.noise_sd = file.vector("/tissue/noise_sd");
  return tissue;
}

void write_joint(Hdf5Writer& file, const JointModel& joint) {
  file.texts("/joint/names", joint.names);
  file.table("/joint/mean", as_table(joint.mean), StoredNumber::float64);
  file.table("/joint/covariance", as_table(joint.covariance), StoredNumber::float64);
  file.texts("/joint/blocks", joint.blocks);
  file.table("/joint/penalties", as_table(joint.penalties), StoredNumber::float64);
  file.scalar("/joint/subjects", joint.subjects, StoredNumber::int32);
}

JointModel read_joint(ModelReader& file) {
  JointModel joint;
  joint.names = file.texts("/joint/names");
  joint.mean = file.vector("/joint/mean");
  joint.covariance = file.matrix("/joint/covariance");
  joint.blocks = file.texts("/joint/blocks");
  joint.penalties = file.matrix("/joint/penalties");
  joint.subjects = static_cast<int>(file.scalar("/joint/subjects"));
  return joint;
}

void write_skin_directions(Hdf5Writer& file, const std::vector<SkinDirection>& directions) {
  std::vector<std::string> names;
  Eigen::Matrix<double, Eigen::Dynamic, 5> values(directions.size(), 5);
  for (std::size_t i = 0; i < directions.size(); ++i) {
    names.push_back(directions[i].name);
    values.row(static_cast<Index>(i)) << directions[i].direction.transpose(),
        directions[i].depth_mm, directions[i].depth_sd_mm;
  }
  file.texts("/landmarks/names", names);
  file.table("/landmarks/skin_direction_depth_sd", as_table(values), StoredNumber::float64);
}

std::vector<SkinDirection> read_skin_directions(ModelReader& file) {
  const std::vector<std::string> names = file.texts("/landmarks/names");
  const auto values = file.of_width<Eigen::Matrix<double, Eigen::Dynamic, 5>>(
      "/landmarks/skin_direction_depth_sd", 5);
  std::vector<SkinDirection> directions;
  if (values.rows() != static_cast<Index>(names.size())) {
    file.refuse("/landmarks", "has names and directions of different lengths");
    return directions;
  }
  for (Index i = 0; i < values.rows(); ++i) {
    directions.push_back({names[static_cast<std::size_t>(i)], values.row(i).head<3>().transpose(),
                          values(i, 3), values(i, 4)});
  }
  return directions;
}

void write_bands(Hdf5Writer& file, const std::vector<BandFactor>& bands) {
  std::vector<std::string> regions;
  Eigen::Matrix<double, Eigen::Dynamic, 3> values(bands.size(), 3);
  for (std::size_t i = 0; i < bands.size(); ++i) {
    regions.push_back(bands[i].region);
    values.row(static_cast<Index>(i)) << bands[i].level, bands[i].factor, bands[i].values;
  }
  file.texts("/calibration/regions", regions);
  file.table("/calibration/level_factor_count", as_table(values), StoredNumber::float64);
}

std::vector<BandFactor> read_bands(ModelReader& file) {
  const std::vector<std::string> regions = file.texts("/calibration/regions");
  const auto values =
      file.of_width<Eigen::Matrix<double, Eigen::Dynamic, 3>>("/calibration/level_factor_count", 3);
  std::vector<BandFactor> bands;
  if (values.rows() != static_cast<Index>(regions.size())) {
    file.refuse("/calibration", "has regions and factors of different lengths");
    return bands;
  }
  for (Index i = 0; i < values.rows(); ++i) {
    bands.push_back({regions[static_cast<std::size_t>(i)], values(i, 0), values(i, 1),
                     static_cast<int>(values(i, 2))});
  }
  return bands;
}

}  // namespace

Result<std::string> encode_model(const FaceModel& model) {
  if (const auto sound = model.validate(); !sound) return forward(sound);
  Hdf5Writer file;
  file.attribute("/", "format", format_name);
  write_shape_model(file, "/skull", model.skull, model.skull_template.boundary);
  write_skull_template(file, model.skull_template);
  write_shape_model(file, "/head", model.head, model.head_template.triangles);
  write_head_template(file, model.head_template);
  write_tissue(file, model.tissue);
  write_joint(file, model.joint);
  write_skin_directions(file, model.skin_directions);
  write_bands(file, model.bands);
  file.text("/provenance", model.provenance);
  return file.finish();
}

Result<FaceModel> decode_model(std::string bytes, const std::string& name) {
  const auto file = Hdf5Reader::open(std::move(bytes), name);
  if (!file) return forward(file);
  const auto format = file->attribute("/", "format");
  if (!format) {
    return fail(ErrorKind::bad_input, name, "is an HDF5 file, but no model of ours",
                "a head model of others is brought in by \"model import-head\"");
  }
  if (*format != format_name) {
    return fail(ErrorKind::bad_input, name,
                fmt::format("is a \"{}\", this program reads \"{}\"", *format, format_name),
                "build the model again");
  }
  ModelReader reader(*file);
  FaceModel model;
  model.skull = read_shape_model(reader, "/skull");
  model.skull_template = read_skull_template(reader);
  model.head = read_shape_model(reader, "/head");
  model.head_template = read_head_template(reader);
  model.tissue = read_tissue(reader);
  model.joint = read_joint(reader);
  model.skin_directions = read_skin_directions(reader);
  model.bands = read_bands(reader);
  model.provenance = reader.text("/provenance");
  if (reader.error()) return tl::unexpected<Error>(*reader.error());
  if (auto sound = model.validate(); !sound) {
    sound.error().where = name + ", " + sound.error().where;
    return forward(sound);
  }
  return model;
}

Result<StatismoModel> decode_statismo(std::string bytes, const std::string& name,
                                      const std::string& group) {
  const auto file = Hdf5Reader::open(std::move(bytes), name);
  if (!file) return forward(file);
  const std::string at = group == "/" ? "" : group;
  if (!file->has(at + "/model/pcaBasis")) {
    return fail(ErrorKind::bad_input, name + ":" + group, "holds no Statismo shape model",
                "it needs representer, model/mean, model/pcaBasis, model/pcaVariance");
  }
  ModelReader reader(*file);
  StatismoModel result;
  result.model = read_shape_model(reader, at);
  result.triangles = reader.cells(at + "/representer/cells");
  if (reader.error()) return tl::unexpected<Error>(*reader.error());
  if (auto sound = result.model.validate(); !sound) {
    sound.error().where = name + ":" + group;
    return forward(sound);
  }
  if (result.triangles.rows() == 0 || result.triangles.minCoeff() < 0 ||
      result.triangles.maxCoeff() >= result.model.vertex_count()) {
    return fail(ErrorKind::bad_input, name + ":" + at + "/representer/cells",
                "names a vertex that is not there, or holds no triangle");
  }
  return result;
}

}  // namespace skullstation
