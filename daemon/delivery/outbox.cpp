#include "daemon/delivery/outbox.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>

#include <algorithm>
#include <cerrno>

#include "core/file.h"
#include "core/random.h"

namespace skullstation {

namespace fs = std::filesystem;

namespace {

using namespace std::chrono_literals;

constexpr std::chrono::milliseconds first_pause = 10s;
constexpr std::chrono::milliseconds longest_pause = 1h;

constexpr int schema_version = 1;
constexpr const char* schema = R"(
CREATE TABLE deliveries (
  id INTEGER PRIMARY KEY AUTOINCREMENT,
  key TEXT NOT NULL UNIQUE,
  package TEXT NOT NULL,
  package_sha256 TEXT NOT NULL,
  case_number TEXT NOT NULL,
  target TEXT NOT NULL,
  state TEXT NOT NULL,
  attempts INTEGER NOT NULL DEFAULT 0,
  created TEXT NOT NULL,
  next_time TEXT,
  last_error TEXT,
  delivered TEXT,
  read_back_sha256 TEXT);
)";

Result<DeliveryState> state_of(const std::string& name, const fs::path& folder) {
  for (const DeliveryState state : delivery_states()) {
    if (to_string(state) == name) return state;
  }
  return fail(ErrorKind::bad_input, (folder / "outbox.db").string(),
              fmt::format("holds a delivery in the unknown state \"{}\"", name),
              "it was written by a newer skullstation: use that one");
}

tl::unexpected<Error> unknown_delivery(std::int64_t id) {
  return fail(ErrorKind::usage, fmt::format("delivery {}", id), "is not in the outbox",
              "`skullstation deliver list` shows all");
}

}  // namespace

std::chrono::milliseconds back_off(int attempts, std::uint64_t seed) {
  const int doublings = std::clamp(attempts - 1, 0, 20);
  const auto longest = std::min(longest_pause, first_pause * (1 << doublings));
  const double share = Random(mix(seed, static_cast<std::uint64_t>(attempts))).uniform(0.5, 1.0);
  return std::chrono::milliseconds(
      static_cast<std::int64_t>(share * static_cast<double>(longest.count())));
}

Result<std::unique_ptr<Outbox>> Outbox::open(const fs::path& folder, const Clock& clock) {
  if (const auto made = make_writable_folder(folder); !made) return forward(made);
  auto database = Database::open(folder / "outbox.db");
  if (!database) return forward(database);
  if (const auto made = database->make_tables(schema, schema_version); !made) return forward(made);
  return std::unique_ptr<Outbox>(new Outbox(folder, clock, *std::move(database)));
}

Result<Delivery> Outbox::add(const SealedPackage& package, const std::string& target) {
  const std::string key = sha256_hex(package.sha256 + " " + target);
  const std::lock_guard lock(mutex_);
  Statement insert = database_.statement(
      "INSERT INTO deliveries (key, package, package_sha256, case_number, target, state, created) "
      "VALUES (?, ?, ?, ?, ?, 'queued', ?) ON CONFLICT (key) DO UPDATE SET package = "
      "excluded.package");
  insert.bind(key)
      .bind(package.folder.string())
      .bind(package.sha256)
      .bind(package.case_number)
      .bind(target)
      .bind(to_iso8601(clock_.utc_now()));
  if (const auto done = insert.done(); !done) return forward(done);
  const auto found = read(fmt::format("WHERE key = '{}'", key));
  if (!found) return forward(found);
  return found->front();
}

Result<std::vector<Delivery>> Outbox::read(const std::string& rest,
                                           const std::optional<std::string>& value) const {
  const std::lock_guard lock(mutex_);
  Statement query = database_.statement(
      "SELECT id, package, package_sha256, case_number, target, state, attempts, created, "
      "next_time, last_error, delivered, read_back_sha256 FROM deliveries " +
      rest);
  if (value) query.bind(*value);
  std::vector<Delivery> rows;
  while (query.next()) {
    Delivery row;
    row.id = query.integer();
    row.package = query.text();
    row.package_sha256 = query.text();
    row.case_number = query.text();
    row.target = query.text();
    const auto state = state_of(query.text(), folder_);
    if (!state) return forward(state);
    row.state = *state;
    row.attempts = static_cast<int>(query.integer());
    row.created = query.text();
    row.next_time = query.optional_text();
    row.last_error = query.optional_text();
    row.delivered = query.optional_text();
    row.read_back_sha256 = query.optional_text();
    rows.push_back(std::move(row));
  }
  if (const auto done = query.done(); !done) return forward(done);
  return rows;
}

Result<std::vector<Delivery>> Outbox::list() const { return read("ORDER BY id"); }

Result<std::vector<Delivery>> Outbox::of_package(const fs::path& folder) const {
  return read("WHERE package = ? ORDER BY id", folder.string());
}

Result<Delivery> Outbox::find(std::int64_t id) const {
  const auto rows = read(fmt::format("WHERE id = {}", id));
  if (!rows) return forward(rows);
  if (rows->empty()) return unknown_delivery(id);
  return rows->front();
}

Result<std::optional<Delivery>> Outbox::oldest_undelivered() const {
  const auto rows = read("WHERE state <> 'delivered' ORDER BY id LIMIT 1");
  if (!rows) return forward(rows);
  return rows->empty() ? std::optional<Delivery>() : rows->front();
}

/// `more_columns` holds one parameter for `value`, or is empty.
Result<Delivery> Outbox::change(std::int64_t id, DeliveryEvent event,
                                const std::string& more_columns,
                                const std::optional<std::string>& value) {
  const std::lock_guard lock(mutex_);
  Transaction transaction(database_);
  const auto row = find(id);
  if (!row) return forward(row);
  const DeliveryTransition* transition = find_transition(row->state, event);
  if (transition == nullptr) {
    return fail(
        ErrorKind::usage, fmt::format("delivery {}", id),
        fmt::format("is {}: \"{}\" is not possible", to_string(row->state), to_string(event)),
        row->state == DeliveryState::sending ? "wait until this attempt is over" : "");
  }
  Statement update = database_.statement(
      fmt::format("UPDATE deliveries SET state = ?{} WHERE id = ?", more_columns));
  update.bind(to_string(transition->to));
  if (more_columns.find('?') != std::string::npos) update.bind_optional(value);
  update.bind(id);
  if (const auto done = update.done(); !done) return forward(done);
  auto changed = find(id);
  if (const auto committed = transaction.commit(); !committed) return forward(committed);
  return changed;
}

Result<Delivery> Outbox::hold(std::int64_t id) {
  return change(id, DeliveryEvent::hold, ", next_time = NULL", {});
}

Result<Delivery> Outbox::retry(std::int64_t id) {
  return change(id, DeliveryEvent::retry, ", next_time = NULL", {});
}

Result<std::unique_ptr<Outbox::Sending>> Outbox::begin_sending() {
  const fs::path file = folder_ / ".sender";
  const int lock = ::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600);
  if (lock < 0) return write_error(file, errno);
  auto sending = std::make_unique<Sending>(*this, lock);
  if (::flock(lock, LOCK_EX | LOCK_NB) != 0) {
    if (errno == EWOULDBLOCK) return std::unique_ptr<Sending>();
    return write_error(file, errno);
  }
  const auto interrupted = read("WHERE state = 'sending'");
  if (!interrupted) return forward(interrupted);
  for (const Delivery& row : *interrupted) {
    const auto queued = change(row.id, DeliveryEvent::interrupted, "", {});
    if (!queued) return forward(queued);
  }
  return sending;
}

Result<std::vector<Delivery>> Outbox::Sending::due() const {
  // What waits longer than it ever could has been written by a clock that was wrong.
  const UtcTime now = outbox_.clock_.utc_now();
  return outbox_.read(fmt::format(
      "WHERE state = 'queued' OR (state = 'waiting' AND (next_time <= '{}' OR next_time > '{}')) "
      "ORDER BY id",
      to_iso8601(now), to_iso8601(now + longest_pause)));
}

Result<Delivery> Outbox::Sending::begin(std::int64_t id) {
  return outbox_.change(id, DeliveryEvent::begin, ", attempts = attempts + 1, next_time = NULL",
                        {});
}

Result<Delivery> Outbox::Sending::verified(std::int64_t id, const std::string& read_back_sha256) {
  return outbox_.change(id, DeliveryEvent::verified,
                        fmt::format(", last_error = NULL, delivered = '{}', read_back_sha256 = ?",
                                    to_iso8601(outbox_.clock_.utc_now())),
                        read_back_sha256);
}

Result<Delivery> Outbox::Sending::failed(std::int64_t id, const Error& error) {
  if (error.kind == ErrorKind::cancelled) {
    return outbox_.change(id, DeliveryEvent::interrupted, "", {});
  }
  if (error.kind != ErrorKind::hardware) {
    return outbox_.change(id, DeliveryEvent::refused, ", last_error = ?", error.message());
  }
  const auto row = outbox_.find(id);
  if (!row) return forward(row);
  const UtcTime next =
      outbox_.clock_.utc_now() + back_off(row->attempts, static_cast<std::uint64_t>(row->id));
  return outbox_.change(id, DeliveryEvent::failed,
                        fmt::format(", next_time = '{}', last_error = ?", to_iso8601(next)),
                        error.message());
}

}  // namespace skullstation
