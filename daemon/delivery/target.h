#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "core/progress.h"
#include "core/result.h"
#include "daemon/delivery/target_config.h"

namespace skullstation {

/// One thing that has to be at the receiver.
struct DeliveryObject {
  std::string name;  ///< there: "2026-0042_1f0c…/data/case/head.ply", or a DICOM instance's UID
  std::filesystem::path file;  ///< here
  std::uint64_t bytes = 0;
  std::string sha256;  ///< of the file; of a DICOM object: of its dataset (dicom_dataset.h)
};

/// A receiver, one protocol a class. Errors of all three functions are told for the operator, and
/// their kind says what becomes of the delivery: `hardware` may pass by itself (no connection, no
/// space, busy), `bad_input` needs a person (access refused, a secret missing).
class Target {
 public:
  virtual ~Target() = default;

  /// Hands the object over. Never replaces another one of that name; that there is one already is
  /// no error here, read_back() shows whether it is the same.
  virtual Result<void> put(const DeliveryObject& object, const Progress& progress) = 0;
  /// Sum of what the receiver gives back under the object's name; nothing if it holds none.
  virtual Result<std::optional<std::string>> read_back(const DeliveryObject& object,
                                                       const Progress& progress) = 0;
  /// Takes a probe away again; false: the protocol has no way to.
  virtual Result<bool> remove(const DeliveryObject& object) = 0;
};

/// Makes ready to talk to a receiver: reads secrets and certificates, does not connect yet.
Result<std::unique_ptr<Target>> open_target(const TargetConfig& config);

// One .cpp each:
Result<std::unique_ptr<Target>> open_folder_target(const TargetConfig& config);
Result<std::unique_ptr<Target>> open_webdav_target(const TargetConfig& config);
Result<std::unique_ptr<Target>> open_s3_target(const TargetConfig& config);
Result<std::unique_ptr<Target>> open_sftp_target(const TargetConfig& config);
Result<std::unique_ptr<Target>> open_dicom_target(const TargetConfig& config);
Result<std::unique_ptr<Target>> open_stow_target(const TargetConfig& config);
Result<std::unique_ptr<Target>> open_fhir_target(const TargetConfig& config);

}  // namespace skullstation
