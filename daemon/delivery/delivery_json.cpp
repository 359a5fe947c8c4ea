#include "daemon/delivery/delivery_json.h"

namespace skullstation {

nlohmann::ordered_json delivery_json(const Delivery& d) {
  using Json = nlohmann::ordered_json;
  const auto optional = [](const std::optional<std::string>& text) {
    return text ? Json(*text) : Json(nullptr);
  };
  return {{"id", d.id},
          {"case", d.case_number},
          {"target", d.target},
          {"state", to_string(d.state)},
          {"attempts", d.attempts},
          {"package", d.package.string()},
          {"package_sha256", d.package_sha256},
          {"created", d.created},
          {"next_attempt", optional(d.next_time)},
          {"last_error", optional(d.last_error)},
          {"delivered", optional(d.delivered)},
          {"read_back_sha256", optional(d.read_back_sha256)}};
}

}  // namespace skullstation
