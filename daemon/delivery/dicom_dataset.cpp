#include "daemon/delivery/dicom_dataset.h"

#include <fmt/format.h>

#include <vector>

#include "core/file.h"
#include "core/sha256.h"
#include "daemon/delivery/dicom_dataset_sum.h"

#include <dcmtk/dcmdata/dcistrmb.h>
#include <dcmtk/dcmdata/dcostrmb.h>
#include <dcmtk/dcmdata/dcwcache.h>

namespace skullstation {

namespace {

std::string text_of(DcmItem& item, const DcmTagKey& tag) {
  OFString text;
  item.findAndGetOFString(tag, text);
  return {text.c_str(), text.size()};
}

Result<DicomInstance> instance_of(DcmFileFormat& file, const std::string& name) {
  DcmDataset& dataset = *file.getDataset();
  if (const OFCondition loaded = dataset.loadAllDataIntoMemory(); loaded.bad()) {
    return fail(ErrorKind::bad_input, name, fmt::format("is cut short ({})", loaded.text()));
  }
  DicomInstance instance;
  instance.sop_class_uid = text_of(dataset, DCM_SOPClassUID);
  instance.transfer_syntax_uid = DcmXfer(dataset.getOriginalXfer()).getXferID();
  instance.study_uid = text_of(dataset, DCM_StudyInstanceUID);
  instance.series_uid = text_of(dataset, DCM_SeriesInstanceUID);
  instance.instance_uid = text_of(dataset, DCM_SOPInstanceUID);
  auto sum = dicom_dataset_sum(dataset, name);
  if (!sum) return forward(sum);
  instance.dataset_sha256 = *std::move(sum);
  return instance;
}

}  // namespace

void silence_dcmtk() {
  static const bool done = [] {
    OFLog::configure(OFLogger::OFF_LOG_LEVEL);
    return true;
  }();
  static_cast<void>(done);
}

Result<std::string> dicom_dataset_sum(DcmDataset& dataset, const std::string& name) {
  std::vector<char> buffer(std::size_t{1} << 20);
  DcmOutputBufferStream stream(buffer.data(), static_cast<offile_off_t>(buffer.size()));
  DcmWriteCache cache;
  Sha256 sum;
  dataset.transferInit();
  OFCondition written = EC_StreamNotifyClient;
  while (written == EC_StreamNotifyClient) {
    written = dataset.write(stream, dataset.getOriginalXfer(), EET_ExplicitLength, &cache,
                            EGL_withoutGL, EPD_withoutPadding);
    void* bytes = nullptr;
    offile_off_t count = 0;
    stream.flushBuffer(bytes, count);
    sum.update({static_cast<const char*>(bytes), static_cast<std::size_t>(count)});
  }
  dataset.transferEnd();
  if (written.bad()) {
    return fail(ErrorKind::bad_input, name,
                fmt::format("is no DICOM dataset that can be written ({})", written.text()));
  }
  return sum.finish();
}

Result<DicomInstance> read_dicom_instance(const std::filesystem::path& file) {
  silence_dcmtk();
  DcmFileFormat read;
  if (const OFCondition loaded = read.loadFile(file.c_str()); loaded.bad()) {
    return fail(ErrorKind::bad_input, file.string(),
                fmt::format("is no DICOM file ({})", loaded.text()));
  }
  return instance_of(read, file.string());
}

Result<DicomInstance> parse_dicom_instance(std::string_view bytes, const std::string& name) {
  silence_dcmtk();
  DcmInputBufferStream stream;
  stream.setBuffer(bytes.data(), static_cast<offile_off_t>(bytes.size()));
  stream.setEos();
  DcmFileFormat read;
  read.transferInit();
  const OFCondition loaded = read.read(stream);
  read.transferEnd();
  if (loaded.bad()) {
    return fail(ErrorKind::bad_input, name, fmt::format("is no DICOM file ({})", loaded.text()));
  }
  return instance_of(read, name);
}

}  // namespace skullstation
