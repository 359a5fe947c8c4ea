#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/progress.h"
#include "core/result.h"
#include "daemon/delivery/outbox.h"
#include "daemon/delivery/target.h"
#include "daemon/evidence/audit_log.h"
#include "daemon/evidence/station_keys.h"

namespace skullstation {

/// Makes sure that the receiver holds each object: asks for it first, sends what is missing, reads
/// back what it sent. Returns the sum of all that was read back; that is sum_of(objects), or it
/// fails.
Result<std::string> deliver_objects(Target& target, const std::vector<DeliveryObject>& objects,
                                    const Progress& progress = {});

struct ProbeResult {
  std::string object;
  bool removed = false;  ///< false: the protocol can't, the probe stays there
};

/// Sends, reads back and removes a probe.
Result<ProbeResult> try_target(const TargetConfig& target, const std::string& station,
                               const std::filesystem::path& work, const Progress& progress = {});

/// Where deliveries that were verified are told, too.
struct DeliveryAudit {
  AuditLogPlace log;
  StationKeys keys;
  std::string who;
};

struct SenderOptions {
  std::vector<TargetConfig> targets;
  std::optional<DeliveryAudit> audit;
  /// Told after each attempt.
  std::function<void(const Delivery&)> told = [](const Delivery&) {};
};

/// With an audit log (unless `audit_log` is empty) and the keys to sign it.
Result<SenderOptions> sender_options(std::vector<TargetConfig> targets,
                                     const std::filesystem::path& audit_log,
                                     const std::filesystem::path& keys_folder,
                                     const std::string& station, const std::string& who);

/// Tries, once, everything in the outbox that is due, or only what has one of `ids`. Returns
/// whether it had the right to: false while another process sends. What happens to a delivery is
/// in its row; fails only where the outbox itself does, and with `cancelled` on request.
Result<bool> send_due(Outbox& outbox, const SenderOptions& options, const Clock& clock,
                      const Progress& progress = {},
                      const std::optional<std::vector<std::int64_t>>& ids = {});

}  // namespace skullstation
