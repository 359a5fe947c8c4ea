#include "daemon/jobs/step_chain.h"

#include <nlohmann/json.hpp>

namespace skullstation {

StepChain station_chain(const std::string& quality, const StepLimits& limits) {
  StepKind reconstruct;
  reconstruct.name = "reconstruct";
  reconstruct.inputs = {std::string(scan_step)};
  reconstruct.promises = {"skull.ply", "cameras.json", "quality.json"};
  reconstruct.options = nlohmann::json{{"quality", quality}}.dump();
  reconstruct.limits = limits;
  StepKind approximate;
  approximate.name = "approximate";
  approximate.inputs = {"reconstruct"};
  approximate.promises = {"case.json", "head.ply", "report.html"};
  approximate.limits = limits;
  return {reconstruct, approximate};
}

}  // namespace skullstation
