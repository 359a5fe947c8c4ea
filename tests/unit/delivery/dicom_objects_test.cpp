#include "daemon/delivery/dicom_objects.h"

#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dctk.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

#include "core/file.h"
#include "daemon/delivery/dicom_dataset.h"
#include "daemon/delivery/jpeg_header.h"
#include "tests/support/process.h"
#include "tests/support/temporary_folder.h"
#include "tests/unit/delivery/sealed_case.h"

namespace skullstation {
namespace {

namespace fs = std::filesystem;
using skullstation::testing::TemporaryFolder;
using ::testing::HasSubstr;
using ::testing::Not;

class DicomObjects : public ::testing::Test {
 protected:
  DicomObjects() : package_(testing::seal_small_case(folder_.path())) {
    fs::create_directories(folder_ / "work");
    fs::create_directories(folder_ / "again");
    objects_ = write_dicom_objects(package_, {}, folder_ / "work").value();
  }
  std::string text_of(const fs::path& file, const DcmTagKey& tag) {
    DcmFileFormat read;
    EXPECT_TRUE(read.loadFile(file.c_str()).good());
    OFString text;
    read.getDataset()->findAndGetOFStringArray(tag, text);
    return text.c_str();
  }

  TemporaryFolder folder_{testing::Medium::memory};
  SealedPackage package_;
  std::vector<DeliveryObject> objects_;
};

TEST_F(DicomObjects, AreOneStudyOfAnUnidentifiedPerson) {
  ASSERT_EQ(objects_.size(), 5U);
  std::set<std::string> classes, instances, studies;
  for (const DeliveryObject& object : objects_) {
    const auto instance = read_dicom_instance(object.file).value();
    classes.insert(instance.sop_class_uid);
    instances.insert(instance.instance_uid);
    studies.insert(instance.study_uid);
    EXPECT_EQ(instance.instance_uid, object.name);
    EXPECT_LE(object.name.size(), 64U);
    EXPECT_EQ(text_of(object.file, DCM_PatientName), "UNIDENTIFIED^2026-0042");
    EXPECT_EQ(text_of(object.file, DCM_PatientID), "2026-0042");
    EXPECT_EQ(text_of(object.file, DCM_StudyDate), "20260131");
  }
  EXPECT_EQ(studies.size(), 1U);
  EXPECT_EQ(instances.size(), 5U);
  EXPECT_EQ(classes, (std::set<std::string>{UID_EncapsulatedSTLStorage, UID_EncapsulatedPDFStorage,
                                            UID_VLPhotographicImageStorage}));
}

TEST_F(DicomObjects, AreTheSameEachTime) {
  const auto again = write_dicom_objects(package_, {}, folder_ / "again").value();
  ASSERT_EQ(again.size(), objects_.size());
  for (std::size_t i = 0; i < again.size(); ++i) {
    EXPECT_EQ(again[i].name, objects_[i].name);
    EXPECT_EQ(again[i].sha256, objects_[i].sha256);
    EXPECT_EQ(sha256_of_file(again[i].file).value(), sha256_of_file(objects_[i].file).value());
  }
}

TEST_F(DicomObjects, CarryTheFilesByteForByte) {
  DcmFileFormat report;
  ASSERT_TRUE(report.loadFile((folder_ / "work/report.dcm").c_str()).good());
  const Uint8* bytes = nullptr;
  Uint32 length = 0;
  report.getDataset()->findAndGetUint8Array(DCM_EncapsulatedDocument, bytes);
  report.getDataset()->findAndGetUint32(DCM_EncapsulatedDocumentLength, length);
  const auto pdf = read_file(folder_ / "case/report.pdf").value();
  ASSERT_EQ(length, pdf.size());
  EXPECT_EQ(length % 2, 1U) << "the padding is what is tested here";
  EXPECT_EQ(std::string(reinterpret_cast<const char*>(bytes), length), pdf);

  const auto jpeg = read_file(folder_ / "session/images/p0_c0_000.png").value();
  ASSERT_TRUE(baseline_jpeg_header(jpeg));
  EXPECT_EQ(baseline_jpeg_header(jpeg)->rows, 48);
  EXPECT_EQ(baseline_jpeg_header(jpeg)->columns, 64);
  EXPECT_THAT(read_file(folder_ / "work/photograph_1.dcm").value(), HasSubstr(jpeg));
  EXPECT_EQ(text_of(folder_ / "work/photograph_2.dcm", DCM_LossyImageCompression), "00");
}

TEST_F(DicomObjects, SayMillimetres) {
  DcmFileFormat skull;
  ASSERT_TRUE(skull.loadFile((folder_ / "work/skull.dcm").c_str()).good());
  DcmItem* unit = nullptr;
  ASSERT_TRUE(
      skull.getDataset()->findAndGetSequenceItem(DCM_MeasurementUnitsCodeSequence, unit).good());
  OFString value, scheme;
  unit->findAndGetOFString(DCM_CodeValue, value);
  unit->findAndGetOFString(DCM_CodingSchemeDesignator, scheme);
  EXPECT_EQ(value, "mm");
  EXPECT_EQ(scheme, "UCUM");
}

TEST_F(DicomObjects, SumsFollowTheDatasetAndNothingElse) {
  const auto bytes = read_file(objects_[0].file).value();
  EXPECT_EQ(parse_dicom_instance(bytes, "x").value().dataset_sha256, objects_[0].sha256);
  std::string other_preamble = bytes;
  other_preamble[5] = 'x';
  EXPECT_EQ(parse_dicom_instance(other_preamble, "x").value().dataset_sha256, objects_[0].sha256);
  std::string other_surface = bytes;
  other_surface[bytes.size() - 60] ^= 1;
  EXPECT_NE(parse_dicom_instance(other_surface, "x").value().dataset_sha256, objects_[0].sha256);
  EXPECT_FALSE(parse_dicom_instance("no DICOM", "x"));
  EXPECT_FALSE(parse_dicom_instance(bytes.substr(0, bytes.size() / 2), "x"));
}

TEST_F(DicomObjects, PhotographsCanBeFewerAndAPackageWithoutAnyOfItFails) {
  EXPECT_EQ(write_dicom_objects(package_, 1, folder_ / "again").value().size(), 4U);
  EXPECT_EQ(write_dicom_objects(package_, 0, folder_ / "again").value().size(), 3U);
  SealedPackage bare = package_;
  bare.files.clear();
  EXPECT_THAT(write_dicom_objects(bare, {}, folder_ / "again").error().message(),
              HasSubstr("holds nothing that DICOM has an object for"));
}

TEST_F(DicomObjects, SatisfyDciodvfy) {
  if (!fs::exists("/usr/bin/dciodvfy")) {
    GTEST_SKIP() << "dciodvfy is not installed (tests/servers/packages.txt)";
  }
  const auto probe = write_dicom_probe("ST-01", folder_ / "again").value();
  objects_.push_back(probe);
  for (const DeliveryObject& object : objects_) {
    testing::Process check({"/usr/bin/dciodvfy", object.file.string()});
    const auto said = check.wait();
    EXPECT_THAT(said.err, ::testing::ContainsRegex("Encapsulated|VLPhoto"))
        << "dciodvfy has not recognised it";
    EXPECT_THAT(said.err, Not(HasSubstr("Error"))) << object.file;
  }
}

TEST(Uid, IsOneOfUuidsAndFollowsTheText) {
  EXPECT_EQ(uid_of("a"), uid_of("a"));
  EXPECT_NE(uid_of("a"), uid_of("b"));
  EXPECT_TRUE(uid_of("a").starts_with("2.25."));
  for (int i = 0; i < 200; ++i) EXPECT_LE(uid_of(std::to_string(i)).size(), 44U);
}

TEST(JpegHeader, OnlyBaselineCounts) {
  EXPECT_FALSE(baseline_jpeg_header(""));
  EXPECT_FALSE(baseline_jpeg_header("\xff\xd8\xff"));
  std::string progressive("\xff\xd8\xff\xc2\x00\x0b\x08\x00\x10\x00\x10\x01\x01\x11\x00", 15);
  EXPECT_FALSE(baseline_jpeg_header(progressive));
  progressive[3] = '\xc0';
  ASSERT_TRUE(baseline_jpeg_header(progressive));
  EXPECT_EQ(baseline_jpeg_header(progressive)->channels, 1);
  for (std::size_t size = 0; size < progressive.size(); ++size) {
    EXPECT_FALSE(baseline_jpeg_header(progressive.substr(0, size))) << size;
  }
}

}  // namespace
}  // namespace skullstation
