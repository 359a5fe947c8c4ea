#include "daemon/delivery/target.h"

namespace skullstation {

Result<std::unique_ptr<Target>> open_target(const TargetConfig& config) {
  switch (config.protocol) {
    case DeliveryProtocol::folder: return open_folder_target(config);
    case DeliveryProtocol::webdav: return open_webdav_target(config);
    case DeliveryProtocol::s3: return open_s3_target(config);
    case DeliveryProtocol::sftp: return open_sftp_target(config);
    case DeliveryProtocol::dicom: return open_dicom_target(config);
    case DeliveryProtocol::stow: return open_stow_target(config);
    case DeliveryProtocol::fhir: return open_fhir_target(config);
  }
  return fail(ErrorKind::bad_input, "protocol", "is unknown");
}

}  // namespace skullstation
