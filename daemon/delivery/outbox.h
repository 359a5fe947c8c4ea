#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "core/clock.h"
#include "core/file_descriptor.h"
#include "core/result.h"
#include "daemon/database/database.h"
#include "daemon/delivery/delivery_state.h"
#include "daemon/delivery/package_objects.h"

namespace skullstation {

/// A package on its way to a target.
struct Delivery {
  std::int64_t id = 0;
  std::filesystem::path package;
  std::string package_sha256;  ///< SealedPackage::sha256
  std::string case_number;
  std::string target;
  DeliveryState state = DeliveryState::queued;
  int attempts = 0;
  std::string created;
  std::optional<std::string> next_time;   ///< waiting: not before
  std::optional<std::string> last_error;  ///< of the last attempt, in plain words
  std::optional<std::string> delivered;   ///< when it was read back and found equal
  /// Sum of what was sent and read back (sum_of), once delivered.
  std::optional<std::string> read_back_sha256;
};

/// How long after the given number of attempts the next one comes [0, 1 h]: 10 s, doubled each
/// time, at most 1 h, of that a random share between a half and all (jitter), so that a receiver
/// which comes back is not met by everybody at once.
std::chrono::milliseconds back_off(int attempts, std::uint64_t seed);

/// What has to be delivered and how far it is: `outbox.db` (SQLite, WAL, synchronous FULL) in its
/// folder. A delivery is known by package and target: the same one is in it once, however often it
/// is asked for, and none is ever removed. Several processes may use it at once; one sends. Safe
/// from any thread.
class Outbox {
 public:
  static Result<std::unique_ptr<Outbox>> open(const std::filesystem::path& folder,
                                              const Clock& clock);

  /// Takes a delivery in; the one that is there already if it was asked for before (of which the
  /// package may lie elsewhere now).
  Result<Delivery> add(const SealedPackage& package, const std::string& target);
  /// All, the oldest first.
  Result<std::vector<Delivery>> list() const;
  /// Those of the package that lies in this folder, the oldest first.
  Result<std::vector<Delivery>> of_package(const std::filesystem::path& folder) const;
  Result<Delivery> find(std::int64_t id) const;
  /// The oldest one that is not delivered, whatever its state.
  Result<std::optional<Delivery>> oldest_undelivered() const;

  /// A person's decisions. Fail with `usage` where the state does not allow it.
  Result<Delivery> hold(std::int64_t id);
  Result<Delivery> retry(std::int64_t id);

  /// The right to send. While it lives no other process sends; released by the kernel however the
  /// process ends.
  class Sending;
  /// Nothing if another process has the right. What an earlier one was sending when it was ended
  /// is queued again.
  Result<std::unique_ptr<Sending>> begin_sending();

  const std::filesystem::path& folder() const { return folder_; }

 private:
  Outbox(std::filesystem::path folder, const Clock& clock, Database database)
      : folder_(std::move(folder)), clock_(clock), database_(std::move(database)) {}
  Result<std::vector<Delivery>> read(const std::string& rest,
                                     const std::optional<std::string>& value = {}) const;
  Result<Delivery> change(std::int64_t id, DeliveryEvent event, const std::string& more_columns,
                          const std::optional<std::string>& value);

  std::filesystem::path folder_;
  const Clock& clock_;
  mutable std::recursive_mutex mutex_;  // of the database
  mutable Database database_;
};

class Outbox::Sending {
 public:
  Sending(Outbox& outbox, int lock) : outbox_(outbox), lock_(lock) {}

  /// What may be sent now, the oldest first: queued, or waiting and due.
  Result<std::vector<Delivery>> due() const;
  Result<Delivery> begin(std::int64_t id);
  Result<Delivery> verified(std::int64_t id, const std::string& read_back_sha256);
  /// `hardware`: waits; `cancelled`: is queued again; else rejected.
  Result<Delivery> failed(std::int64_t id, const Error& error);

 private:
  Outbox& outbox_;
  FileDescriptor lock_;
};

}  // namespace skullstation
