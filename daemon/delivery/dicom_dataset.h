#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "core/result.h"

namespace skullstation {

/// How a DICOM instance is asked for.
struct DicomInstance {
  std::string sop_class_uid;
  std::string transfer_syntax_uid;
  std::string study_uid;
  std::string series_uid;
  std::string instance_uid;
  std::string dataset_sha256;
};

/// Reads a DICOM file. Its sum is of the dataset alone, written in its own transfer syntax without
/// group lengths: the part that a receiver must give back unchanged, whatever it writes around it.
Result<DicomInstance> read_dicom_instance(const std::filesystem::path& file);

/// The same of a file in memory; `name` stands for it in errors.
Result<DicomInstance> parse_dicom_instance(std::string_view bytes, const std::string& name);

}  // namespace skullstation
