#include "daemon/delivery/delivery.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "core/file.h"
#include "daemon/delivery/package_objects.h"

namespace skullstation {

namespace fs = std::filesystem;

namespace {

/// The receiver holds something else: is it here or there that bytes have changed?
tl::unexpected<Error> other_bytes(const DeliveryObject& object, const std::string& there) {
  return fail(ErrorKind::bad_input, object.name,
              fmt::format("the receiver holds other bytes under this name (SHA-256 {:.12}…, ours "
                          "{:.12}…)",
                          there, object.sha256),
              "nothing was replaced: find out there who put them, then retry");
}

Result<void> deliver_object(Target& target, const DeliveryObject& object,
                            const Progress& progress) {
  auto there = target.read_back(object, progress.part(0.0, 0.1));
  if (!there) return forward(there);
  if (!there->has_value()) {
    if (auto put = target.put(object, progress.part(0.1, 0.6)); !put) return put;
    there = target.read_back(object, progress.part(0.6, 1.0));
    if (!there) return forward(there);
    if (!there->has_value()) {
      return fail(ErrorKind::hardware, object.name,
                  "the receiver took it without an error and does not hold it");
    }
  }
  if (**there != object.sha256) return other_bytes(object, **there);
  return {};
}

const TargetConfig* find_target(const std::vector<TargetConfig>& targets, const std::string& name) {
  const auto found = std::ranges::find(targets, name, &TargetConfig::name);
  return found == targets.end() ? nullptr : &*found;
}

/// A folder for what is made for one delivery; removed at the end of the scope.
class WorkFolder {
 public:
  explicit WorkFolder(fs::path path) : path_(std::move(path)) { clear(); }
  ~WorkFolder() { clear(); }
  WorkFolder(const WorkFolder&) = delete;
  WorkFolder& operator=(const WorkFolder&) = delete;
  const fs::path& path() const { return path_; }

 private:
  void clear() const {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  fs::path path_;
};

/// The package as it was when the delivery was asked for.
Result<SealedPackage> package_of(const Delivery& row) {
  std::error_code ignored;
  if (!fs::exists(row.package, ignored)) {
    return fail(ErrorKind::hardware, row.package.string(), "the package is not there",
                "put it back; it is tried again");
  }
  auto package = read_sealed_package(row.package);
  if (package && package->sha256 != row.package_sha256) {
    return fail(ErrorKind::bad_input, row.package.string(),
                "is not the package that was to be delivered: its manifests have changed",
                "put the right one back, then retry");
  }
  return package;
}

/// A file that no longer is what the manifest says must not be blamed on the receiver.
Result<void> check_sum(const DeliveryObject& object, const SealedPackage& package) {
  if (object.file.string().rfind(package.folder.string(), 0) != 0) return {};
  const auto sum = sha256_of_file(object.file);
  if (!sum) return forward(sum);
  if (*sum == object.sha256) return {};
  return fail(ErrorKind::bad_input, object.file.string(), "is not as it was sealed",
              fmt::format("`skullstation verify {}` says where; put back a sound copy, then retry",
                          package.folder.string()));
}

Result<std::string> attempt(const Delivery& row, const TargetConfig& config, const fs::path& work,
                            const Progress& progress) {
  const auto package = package_of(row);
  if (!package) return forward(package);
  auto target = open_target(config);
  if (!target) return forward(target);
  const auto objects = objects_for(config, *package, work);
  if (!objects) return forward(objects);
  for (const DeliveryObject& object : *objects) {
    if (const auto sound = check_sum(object, *package); !sound) return forward(sound);
  }
  return deliver_objects(**target, *objects, progress);
}

Result<void> write_audit_entry(const DeliveryAudit& audit, const Delivery& row,
                               const std::string& read_back, const Clock& clock) {
  const auto entry =
      append_audit_entry(audit.log,
                         {audit.who, "delivery", row.case_number,
                          nlohmann::ordered_json{{"package", row.package.filename().string()},
                                                 {"package_sha256", row.package_sha256},
                                                 {"target", row.target},
                                                 {"read_back_sha256", read_back}}
                              .dump()},
                         audit.keys, clock);
  if (!entry) return forward(entry);
  return {};
}

}  // namespace

Result<std::string> deliver_objects(Target& target, const std::vector<DeliveryObject>& objects,
                                    const Progress& progress) {
  double bytes = 1.0;
  for (const DeliveryObject& object : objects) bytes += static_cast<double>(object.bytes);
  double done = 0.0;
  for (const DeliveryObject& object : objects) {
    if (progress.stop.stop_requested()) {
      return fail(ErrorKind::cancelled, object.name, "delivery was stopped on request");
    }
    const double end = done + static_cast<double>(object.bytes);
    progress.report(done / bytes, "delivering " + object.name);
    if (const auto sent = deliver_object(target, object, progress.part(done / bytes, end / bytes));
        !sent) {
      return forward(sent);
    }
    done = end;
  }
  return sum_of(objects);  // each was found equal
}

Result<ProbeResult> try_target(const TargetConfig& target, const std::string& station,
                               const fs::path& work, const Progress& progress) {
  const WorkFolder folder(work);
  const auto opened = open_target(target);
  if (!opened) return forward(opened);
  const auto probe = probe_for(target, station, folder.path());
  if (!probe) return forward(probe);
  if (const auto sent = deliver_objects(**opened, {*probe}, progress); !sent) return forward(sent);
  const auto removed = (*opened)->remove(*probe);
  if (!removed) return forward(removed);
  return ProbeResult{probe->name, *removed};
}

Result<SenderOptions> sender_options(std::vector<TargetConfig> targets, const fs::path& audit_log,
                                     const fs::path& keys_folder, const std::string& station,
                                     const std::string& who) {
  SenderOptions options;
  options.targets = std::move(targets);
  if (audit_log.empty()) return options;
  auto keys = read_station_keys(keys_folder);
  if (!keys) return forward(keys);
  options.audit = DeliveryAudit{{audit_log, station}, *std::move(keys), who};
  return options;
}

Result<bool> send_due(Outbox& outbox, const SenderOptions& options, const Clock& clock,
                      const Progress& progress,
                      const std::optional<std::vector<std::int64_t>>& ids) {
  const auto sending = outbox.begin_sending();
  if (!sending) return forward(sending);
  if (*sending == nullptr) return false;
  auto due = (*sending)->due();
  if (!due) return forward(due);
  for (const Delivery& row : *due) {
    if (ids && std::ranges::find(*ids, row.id) == ids->end()) continue;
    const TargetConfig* target = find_target(options.targets, row.target);
    if (target != nullptr && (!target->enabled || !target->open_at(clock.utc_now()))) continue;
    if (const auto begun = (*sending)->begin(row.id); !begun) {
      if (begun.error().kind == ErrorKind::usage) continue;  // held meanwhile
      return forward(begun);
    }
    const WorkFolder work(outbox.folder() / "work" / std::to_string(row.id));
    auto sum = target == nullptr ? fail(ErrorKind::bad_input, "target " + row.target,
                                        "is no longer in the configuration",
                                        "put it back among [[delivery.targets]], then retry")
                                 : attempt(row, *target, work.path(), progress);
    if (sum && options.audit) {
      if (const auto told = write_audit_entry(*options.audit, row, *sum, clock); !told) {
        sum = forward(told);
      }
    }
    const auto end =
        sum ? (*sending)->verified(row.id, *sum) : (*sending)->failed(row.id, sum.error());
    if (!end) return forward(end);
    options.told(*end);
    if (progress.stop.stop_requested()) {
      return fail(ErrorKind::cancelled, "outbox", "sending was stopped on request");
    }
  }
  return true;
}

}  // namespace skullstation
