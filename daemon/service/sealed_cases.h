#pragma once

#include <filesystem>
#include <vector>

#include "core/result.h"
#include "daemon/delivery/outbox.h"
#include "daemon/delivery/target_config.h"
#include "daemon/jobs/case_store.h"

namespace skullstation {

// From the job that has sealed a case to its verified delivery. Jobs and outbox are two databases:
// nothing is ever changed in both at once. Instead the first is looked at again and again, and what
// the second lacks is made up for, so that a crash at any moment loses nothing; what is there
// already is found by the package's sum, so that nothing is doubled.

/// Where the package of a `seal` job lies, for deliveries and for whoever wants to take it along.
std::filesystem::path package_folder(const CaseStore& store, const Job& seal);

/// Lays out every package whose case is not verified yet (hard links to the store's blobs) and puts
/// it into the outbox for each target that is enabled; marks a case verified once there is a
/// delivery of its present package and all of them have been read back and found equal.
Result<void> hand_over_sealed_cases(CaseStore& store, Outbox& outbox,
                                    const std::vector<TargetConfig>& targets);

/// Of all packages of the case, the oldest first.
Result<std::vector<Delivery>> deliveries_of(CaseStore& store, const Outbox& outbox,
                                            std::int64_t case_id);

/// Removes the packages of cases whose files were deleted.
Result<void> remove_packages_of_deleted_cases(CaseStore& store);

}  // namespace skullstation
