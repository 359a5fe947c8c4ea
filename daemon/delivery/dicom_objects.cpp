#include "daemon/delivery/dicom_objects.h"

#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dcpixel.h>
#include <dcmtk/dcmdata/dcpixseq.h>
#include <dcmtk/dcmdata/dcpxitem.h>
#include <dcmtk/dcmdata/dctk.h>
#include <dcmtk/dcmdata/dcuid.h>
#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "core/file.h"
#include "core/session/image_file.h"
#include "daemon/delivery/dicom_dataset.h"
#include "daemon/delivery/jpeg_header.h"
#include "daemon/evidence/package_source.h"
#include "reconstruction/io/mesh_file.h"

namespace skullstation {

namespace fs = std::filesystem;

namespace {

/// What all objects of a study say alike.
struct Study {
  std::string seed;  ///< what UIDs are made of
  std::string case_number;
  std::string station;
  std::string date, time;  ///< "20260131", "120000"; empty if nobody recorded them
  std::string version;
};

/// At most 64 characters of printable ASCII without '\' and '^' (LO, SH: PS3.5 6.2).
std::string dicom_text(const std::string& text, std::size_t longest) {
  std::string out;
  for (const unsigned char c : text) {
    const bool plain = c >= 32 && c < 127 && c != '\\' && c != '^' && c != '=';
    out += plain ? static_cast<char>(c) : '_';
  }
  return out.substr(0, longest);
}

void set(DcmItem& item, const DcmTagKey& tag, const std::string& value) {
  item.putAndInsertString(tag, value.c_str());
}

void set_code(DcmItem& item, const DcmTagKey& sequence, const char* value, const char* scheme,
              const char* meaning) {
  DcmItem* code = nullptr;
  item.findOrCreateSequenceItem(sequence, code, 0);
  set(*code, DCM_CodeValue, value);
  set(*code, DCM_CodingSchemeDesignator, scheme);
  set(*code, DCM_CodeMeaning, meaning);
}

/// Patient, study, series, equipment, SOP common: the same modules in every object.
void set_common(DcmDataset& dataset, const Study& study, const std::string& role,
                const char* sop_class, const char* modality, int series, const char* series_name,
                int instance) {
  set(dataset, DCM_SOPClassUID, sop_class);
  set(dataset, DCM_SOPInstanceUID, uid_of(study.seed + " " + role));
  set(dataset, DCM_PatientName, "UNIDENTIFIED^" + dicom_text(study.case_number, 50));
  set(dataset, DCM_PatientID, dicom_text(study.case_number, 64));
  if (!study.station.empty()) set(dataset, DCM_IssuerOfPatientID, dicom_text(study.station, 64));
  set(dataset, DCM_PatientBirthDate, "");
  set(dataset, DCM_PatientSex, "");
  set(dataset, DCM_PatientComments,
      "Unidentified human remains. A facial approximation is an investigative aid, not an "
      "identification.");
  set(dataset, DCM_StudyInstanceUID, uid_of(study.seed + " study"));
  set(dataset, DCM_StudyDate, study.date);
  set(dataset, DCM_StudyTime, study.time);
  set(dataset, DCM_ReferringPhysicianName, "");
  set(dataset, DCM_StudyID, dicom_text(study.case_number, 16));
  set(dataset, DCM_AccessionNumber, "");
  set(dataset, DCM_StudyDescription, "Skull scan and facial approximation");
  set(dataset, DCM_Modality, modality);
  set(dataset, DCM_SeriesInstanceUID, uid_of(fmt::format("{} series {}", study.seed, series)));
  set(dataset, DCM_SeriesNumber, std::to_string(series));
  set(dataset, DCM_SeriesDescription, series_name);
  set(dataset, DCM_BodyPartExamined, "SKULL");
  set(dataset, DCM_InstanceNumber, std::to_string(instance));
  set(dataset, DCM_Manufacturer, "Skullstation");
  set(dataset, DCM_ManufacturerModelName, "Skullstation");
  set(dataset, DCM_DeviceSerialNumber,
      study.station.empty() ? "unknown" : dicom_text(study.station, 64));
  set(dataset, DCM_SoftwareVersions, dicom_text(study.version, 64));
  set(dataset, DCM_ContentDate, study.date);
  set(dataset, DCM_ContentTime, study.time);
}

Result<DeliveryObject> save(DcmFileFormat& file, E_TransferSyntax syntax, const fs::path& path) {
  const OFCondition saved =
      file.saveFile(path.c_str(), syntax, EET_ExplicitLength, EGL_withoutGL, EPD_withoutPadding);
  if (saved.bad()) {
    return fail(ErrorKind::bad_input, path.string(),
                fmt::format("can't be written as DICOM ({})", saved.text()));
  }
  const auto instance = read_dicom_instance(path);
  if (!instance) return forward(instance);
  return DeliveryObject{instance->instance_uid, path, fs::file_size(path),
                        instance->dataset_sha256};
}

/// The file goes into the object byte for byte.
void set_document(DcmDataset& dataset, const std::string& bytes, const char* mime,
                  const std::string& title) {
  set(dataset, DCM_AcquisitionDateTime, "");
  set(dataset, DCM_BurnedInAnnotation, "NO");
  set(dataset, DCM_DocumentTitle, title);
  dataset.insertEmptyElement(DCM_ConceptNameCodeSequence);
  set(dataset, DCM_MIMETypeOfEncapsulatedDocument, mime);
  dataset.putAndInsertUint32(DCM_EncapsulatedDocumentLength, static_cast<Uint32>(bytes.size()));
  const std::string even = bytes.size() % 2 == 0 ? bytes : bytes + '\0';
  dataset.putAndInsertUint8Array(DCM_EncapsulatedDocument,
                                 reinterpret_cast<const Uint8*>(even.data()), even.size());
}

Result<DeliveryObject> write_stl_object(const Study& study, const fs::path& mesh_file,
                                        const char* role, const char* title, int instance,
                                        const fs::path& work) {
  const auto mesh = read_mesh(mesh_file);
  if (!mesh) return forward(mesh);
  const fs::path stl = work / fmt::format("{}.stl", role);
  if (const auto written = write_mesh(*mesh, stl); !written) return forward(written);
  const auto bytes = read_file(stl);
  if (!bytes) return forward(bytes);
  DcmFileFormat file;
  DcmDataset& dataset = *file.getDataset();
  set_common(dataset, study, role, UID_EncapsulatedSTLStorage, "M3D", 1, "Surfaces", instance);
  set(dataset, DCM_FrameOfReferenceUID, uid_of(fmt::format("{} frame {}", study.seed, role)));
  set(dataset, DCM_PositionReferenceIndicator, "");
  set_document(dataset, *bytes, "model/stl", title);
  set_code(dataset, DCM_MeasurementUnitsCodeSequence, "mm", "UCUM", "mm");
  return save(file, EXS_LittleEndianExplicit, work / fmt::format("{}.dcm", role));
}

Result<DeliveryObject> write_pdf_object(const Study& study, const std::string& pdf,
                                        const std::string& title, const fs::path& work) {
  DcmFileFormat file;
  DcmDataset& dataset = *file.getDataset();
  set_common(dataset, study, "report", UID_EncapsulatedPDFStorage, "DOC", 2, "Report", 1);
  set(dataset, DCM_ConversionType, "WSD");
  set_document(dataset, pdf, "application/pdf", title);
  return save(file, EXS_LittleEndianExplicit, work / "report.dcm");
}

void set_picture(DcmDataset& dataset, int rows, int columns, int channels, const char* colours) {
  dataset.putAndInsertUint16(DCM_SamplesPerPixel, static_cast<Uint16>(channels));
  set(dataset, DCM_PhotometricInterpretation, colours);
  if (channels > 1) dataset.putAndInsertUint16(DCM_PlanarConfiguration, 0);
  dataset.putAndInsertUint16(DCM_Rows, static_cast<Uint16>(rows));
  dataset.putAndInsertUint16(DCM_Columns, static_cast<Uint16>(columns));
  dataset.putAndInsertUint16(DCM_BitsAllocated, 8);
  dataset.putAndInsertUint16(DCM_BitsStored, 8);
  dataset.putAndInsertUint16(DCM_HighBit, 7);
  dataset.putAndInsertUint16(DCM_PixelRepresentation, 0);
}

/// A baseline JPEG file goes in byte for byte; anything else as uncompressed pixels.
Result<E_TransferSyntax> set_pixels(DcmDataset& dataset, const std::string& bytes,
                                    const std::string& name) {
  const auto jpeg = baseline_jpeg_header(bytes);
  if (jpeg) {
    set_picture(dataset, jpeg->rows, jpeg->columns, jpeg->channels,
                jpeg->channels == 1      ? "MONOCHROME2"
                : jpeg->chroma_is_halved ? "YBR_FULL_422"
                                         : "YBR_FULL");
    set(dataset, DCM_LossyImageCompression, "01");
    set(dataset, DCM_LossyImageCompressionMethod, "ISO_10918_1");
    const double raw = static_cast<double>(jpeg->rows) * jpeg->columns * jpeg->channels;
    set(dataset, DCM_LossyImageCompressionRatio,
        fmt::format("{:.2f}", raw / static_cast<double>(bytes.size())));
    auto* sequence = new DcmPixelSequence(DcmTag(DCM_PixelData, EVR_OB));
    sequence->insert(new DcmPixelItem(DcmTag(DCM_PixelItemTag)));  // no offset table
    DcmOffsetList offsets;
    std::string even = bytes.size() % 2 == 0 ? bytes : bytes + '\0';
    sequence->storeCompressedFrame(offsets, reinterpret_cast<Uint8*>(even.data()),
                                   static_cast<Uint32>(even.size()), 0);
    auto* pixels = new DcmPixelData(DCM_PixelData);
    pixels->putOriginalRepresentation(EXS_JPEGProcess1, nullptr, sequence);
    dataset.insert(pixels);
    return EXS_JPEGProcess1;
  }
  const auto image = decode_image(bytes, name);
  if (!image) return forward(image);
  set_picture(dataset, image->height, image->width, image->channels,
              image->channels == 1 ? "MONOCHROME2" : "RGB");
  set(dataset, DCM_LossyImageCompression, "00");
  std::vector<std::uint8_t> even(image->pixels.begin(), image->pixels.end());
  if (even.size() % 2 != 0) even.push_back(0);
  dataset.putAndInsertUint8Array(DCM_PixelData, even.data(), even.size());
  return EXS_LittleEndianExplicit;
}

Result<DeliveryObject> write_photograph(const Study& study, const fs::path& image,
                                        const std::string& name, int number, const fs::path& work) {
  const auto bytes = read_file(image);
  if (!bytes) return forward(bytes);
  DcmFileFormat file;
  DcmDataset& dataset = *file.getDataset();
  set_common(dataset, study, "photograph " + name, UID_VLPhotographicImageStorage, "XC", 3,
             "Photographs", number);
  set(dataset, DCM_ImageType, "ORIGINAL\\PRIMARY");
  set(dataset, DCM_PatientOrientation, "");
  set(dataset, DCM_BurnedInAnnotation, "NO");
  set(dataset, DCM_ImageComments, dicom_text(name, 64));
  dataset.insertEmptyElement(DCM_AcquisitionContextSequence);
  const auto syntax = set_pixels(dataset, *bytes, image.string());
  if (!syntax) return forward(syntax);
  return save(file, *syntax, work / fmt::format("photograph_{}.dcm", number));
}

Study study_of(const SealedPackage& package) {
  Study study{package.sha256, package.case_number, package.station, "", "", "1"};
  const auto session = read_file(package.folder / "data/session/session.json");
  if (!session) return study;  // sealed without its session
  const auto json = nlohmann::ordered_json::parse(*session, nullptr, false);
  std::string digits;
  for (const char c : text_at(json, "/created")) {
    if (c >= '0' && c <= '9') digits += c;
  }
  if (digits.size() < 14) return study;
  study.date = digits.substr(0, 8);
  study.time = digits.substr(8, 6);
  return study;
}

bool holds(const SealedPackage& package, const std::string& path) {
  return std::ranges::find(package.files, path, &ManifestLine::path) != package.files.end();
}

std::vector<std::string> photographs_of(const SealedPackage& package, std::optional<int> most) {
  std::vector<std::string> all;
  for (const ManifestLine& line : package.files) {
    const std::string extension = fs::path(line.path).extension().string();
    const bool picture = extension == ".jpg" || extension == ".jpeg" || extension == ".png";
    if (picture && line.path.starts_with("data/session/images/")) all.push_back(line.path);
  }
  if (!most || all.size() <= static_cast<std::size_t>(*most)) return all;
  std::vector<std::string> chosen;
  chosen.reserve(static_cast<std::size_t>(*most));
  for (int i = 0; i < *most; ++i) chosen.push_back(all[all.size() * i / *most]);
  return chosen;
}

}  // namespace

std::string uid_of(const std::string& text) {
  // The first 128 bits of the sum, marked as a UUID of version 8 (free form), as a decimal number.
  const std::string hex = sha256_hex(text);
  std::vector<int> digits(32);  // base 16, most significant first
  for (int i = 0; i < 32; ++i) digits[i] = std::stoi(hex.substr(i, 1), nullptr, 16);
  digits[12] = 8;
  digits[16] = 8 + digits[16] % 4;
  std::string decimal;
  while (std::ranges::any_of(digits, [](int d) { return d != 0; })) {
    int rest = 0;
    for (int& digit : digits) {
      rest = rest * 16 + digit;
      digit = rest / 10;
      rest %= 10;
    }
    decimal.insert(decimal.begin(), static_cast<char>('0' + rest));
  }
  return "2.25." + decimal;
}

Result<std::vector<DeliveryObject>> write_dicom_objects(const SealedPackage& package,
                                                        std::optional<int> max_photographs,
                                                        const fs::path& work) {
  const Study study = study_of(package);
  std::vector<DeliveryObject> objects;
  const auto add = [&](Result<DeliveryObject> object) -> Result<void> {
    if (!object) return forward(object);
    objects.push_back(*std::move(object));
    return {};
  };
  // The skull as it was measured; what was fitted to it where the measurement is not there.
  for (const char* skull : {"data/reconstruction/skull.ply", "data/case/skull_fitted.ply"}) {
    if (!objects.empty() || !holds(package, skull)) continue;
    const char* title = std::string_view(skull).find("fitted") == std::string_view::npos
                            ? "Skull, measured surface"
                            : "Skull, fitted template";
    if (auto made = add(write_stl_object(study, package.folder / skull, "skull", title, 1, work));
        !made) {
      return forward(made);
    }
  }
  if (holds(package, "data/case/head.ply")) {
    if (auto made =
            add(write_stl_object(study, package.folder / "data/case/head.ply", "head",
                                 "Facial approximation (statistical, no identification)", 2, work));
        !made) {
      return forward(made);
    }
  }
  if (holds(package, "data/case/report.pdf")) {
    const auto pdf = read_file(package.folder / "data/case/report.pdf");
    if (!pdf) return forward(pdf);
    if (auto made = add(write_pdf_object(study, *pdf, "Report", work)); !made) return forward(made);
  }
  int number = 0;
  for (const std::string& path : photographs_of(package, max_photographs)) {
    if (auto made = add(write_photograph(study, package.folder / path, fs::path(path).filename(),
                                         ++number, work));
        !made) {
      return forward(made);
    }
  }
  if (objects.empty()) {
    return fail(ErrorKind::bad_input, package.folder.string(),
                "holds nothing that DICOM has an object for (skull, head, report, photographs)");
  }
  return objects;
}

Result<DeliveryObject> write_dicom_probe(const std::string& station, const fs::path& work) {
  const Study study{"probe of station " + station, "SKULLSTATION-PROBE", station, "", "", "1"};
  return write_pdf_object(study, "%PDF-1.4\n% a station tried whether it can deliver here\n%%EOF\n",
                          "Probe, may be removed", work);
}

}  // namespace skullstation
