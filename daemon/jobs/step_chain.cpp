#include "daemon/jobs/step_chain.h"

#include <nlohmann/json.hpp>

namespace skullstation {

StepChain station_chain(const std::string& quality, const StepLimits& limits,
                        const SealSettings& seal) {
  StepKind reconstruct;
  reconstruct.name = "reconstruct";
  reconstruct.inputs = {std::string(scan_step)};
  reconstruct.promises = {"skull.ply", "cameras.json", "quality.json"};
  reconstruct.options = nlohmann::json{{"quality", quality}}.dump();
  reconstruct.limits = limits;
  StepKind approximate;
  approximate.name = result_step;
  approximate.inputs = {"reconstruct"};
  approximate.promises = {"case.json", "head.ply", "report.html"};
  approximate.limits = limits;
  StepKind package;
  package.name = seal_step;
  package.inputs = {std::string(scan_step), "reconstruct", "approximate"};
  package.promises = {"bagit.txt", "manifest-sha256.txt", "tagmanifest-sha256.txt",
                      "signature/ed25519.sig"};
  package.station = nlohmann::json{{"keys_folder", seal.keys_folder},
                                   {"audit_log", seal.audit_log},
                                   {"time_stamp_url", seal.time_stamp_url}}
                        .dump();
  package.on_approval = seal.on_approval;
  package.limits = limits;
  package.limits.network = !seal.time_stamp_url.empty();
  return {reconstruct, approximate, package};
}

}  // namespace skullstation
