#include "daemon/service/sealed_cases.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <system_error>

#include "core/file.h"
#include "core/file_descriptor.h"
#include "core/staged_folder.h"
#include "daemon/delivery/package_objects.h"

namespace skullstation {

namespace fs = std::filesystem;

namespace {

fs::path packages_folder(const CaseStore& store) { return store.folder() / "packages"; }

/// The folder appears whole or not at all, and outlasts a power cut.
Result<void> lay_out_package(CaseStore& store, const Job& seal, const fs::path& place) {
  std::error_code error;
  if (fs::exists(place, error)) return {};
  StagedFolder staged(place);
  if (auto made = staged.make(); !made) return made;
  if (auto laid = store.lay_out(seal.id, staged.path()); !laid) return laid;
  for (auto entry = fs::recursive_directory_iterator(staged.path(), error);
       !error && entry != fs::recursive_directory_iterator(); entry.increment(error)) {
    if (!entry->is_directory()) continue;
    if (auto synced = sync_folder(entry->path()); !synced) return synced;
  }
  if (auto synced = sync_folder(staged.path()); !synced) return synced;
  return staged.put_in_place();
}

/// The deliveries of the package, one for each enabled target.
Result<std::vector<Delivery>> queue_package(Outbox& outbox, const fs::path& place,
                                            const std::vector<TargetConfig>& targets) {
  auto there = outbox.of_package(place);
  if (!there) return there;
  const bool complete = std::ranges::all_of(targets, [&](const TargetConfig& target) {
    return !target.enabled ||
           std::ranges::find(*there, target.name, &Delivery::target) != there->end();
  });
  if (complete) return there;
  const auto package = read_sealed_package(place);
  if (!package) return forward(package);
  for (const TargetConfig& target : targets) {
    if (!target.enabled) continue;
    if (const auto row = outbox.add(*package, target.name); !row) return forward(row);
  }
  return outbox.of_package(place);
}

Result<void> hand_over(CaseStore& store, Outbox& outbox, const std::vector<TargetConfig>& targets,
                       const Job& seal) {
  const fs::path place = package_folder(store, seal);
  if (auto laid = lay_out_package(store, seal, place); !laid) return laid;
  const auto rows = queue_package(outbox, place, targets);
  if (!rows) return forward(rows);
  const bool all = std::ranges::all_of(
      *rows, [](const Delivery& row) { return row.state == DeliveryState::delivered; });
  if (rows->empty() || !all) return {};
  const auto verified = store.set_verified(seal.case_id, seal.id);
  if (!verified) return forward(verified);
  return {};
}

}  // namespace

fs::path package_folder(const CaseStore& store, const Job& seal) {
  const auto place = packages_folder(store) / fmt::format("case-{}-job-{}", seal.case_id, seal.id);
  return fs::absolute(place).lexically_normal();  // as the outbox knows it
}

Result<void> hand_over_sealed_cases(CaseStore& store, Outbox& outbox,
                                    const std::vector<TargetConfig>& targets) {
  const auto sealed = store.unverified(seal_step);
  if (!sealed) return forward(sealed);
  if (sealed->empty()) return {};
  if (auto made = make_writable_folder(packages_folder(store)); !made) return made;
  // One that is damaged must not hold the others back.
  Result<void> first;
  for (const Job& seal : *sealed) {
    auto handed = hand_over(store, outbox, targets, seal);
    if (!handed && first) first = std::move(handed);
  }
  return first;
}

Result<std::vector<Delivery>> deliveries_of(CaseStore& store, const Outbox& outbox,
                                            std::int64_t case_id) {
  const auto jobs = store.jobs(case_id);
  if (!jobs) return forward(jobs);
  std::vector<Delivery> found;
  for (const Job& job : *jobs) {
    if (job.step != seal_step) continue;
    auto rows = outbox.of_package(package_folder(store, job));
    if (!rows) return rows;
    std::ranges::move(*rows, std::back_inserter(found));
  }
  return found;
}

Result<void> remove_packages_of_deleted_cases(CaseStore& store) {
  const auto cases = store.cases();
  if (!cases) return forward(cases);
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(packages_folder(store), error)) {
    const std::string name = entry.path().filename().string();
    const auto of = std::ranges::find_if(*cases, [&](const Case& row) {
      return row.removed && name.starts_with(fmt::format("case-{}-", row.id));
    });
    if (of == cases->end()) continue;
    std::error_code failed;
    fs::remove_all(entry.path(), failed);
    if (failed) return write_error(entry.path(), failed.value());
  }
  return {};
}

}  // namespace skullstation
