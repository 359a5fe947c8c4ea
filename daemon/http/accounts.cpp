#include "daemon/http/accounts.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>

#include "core/file.h"
#include "daemon/http/message.h"

namespace skullstation {

namespace {

constexpr std::array roles{Role::viewer, Role::operates, Role::examiner, Role::administrator,
                           Role::auditor};
constexpr std::array role_names{"viewer", "operator", "examiner", "administrator", "auditor"};

constexpr int schema_version = 1;
constexpr const char* schema = R"(
CREATE TABLE accounts (
  name TEXT PRIMARY KEY,
  role TEXT NOT NULL,
  password TEXT NOT NULL,
  created TEXT NOT NULL,
  disabled INTEGER NOT NULL DEFAULT 0) WITHOUT ROWID;
CREATE TABLE sign_ins (
  token_sha256 TEXT PRIMARY KEY,
  account TEXT NOT NULL REFERENCES accounts ON DELETE CASCADE,
  csrf TEXT NOT NULL,
  begun_s INTEGER NOT NULL,
  seen_s INTEGER NOT NULL) WITHOUT ROWID;
)";

Result<void> check_name(const std::string& name) {
  const bool good =
      !name.empty() && name.size() <= 32 && std::ranges::all_of(name, [](unsigned char c) {
        return std::isalnum(c) != 0 || c == '.' || c == '-' || c == '_';
      });
  if (good) return {};
  return fail(ErrorKind::bad_input, "name",
              "must be 1 to 32 letters, digits, dots, hyphens and underscores");
}

Result<void> check_password(const std::string& password) {
  constexpr std::size_t least = 10;
  constexpr std::size_t most = 200;
  if (!is_utf8(password) || password.size() < least || password.size() > most) {
    return fail(ErrorKind::bad_input, "password",
                fmt::format("must have {} to {} characters", least, most),
                "four words that don't belong together are easy to remember");
  }
  return {};
}

}  // namespace

const char* to_string(Role role) { return role_names[static_cast<std::size_t>(role)]; }

std::optional<Role> role_named(std::string_view name) {
  for (const Role role : roles) {
    if (name == to_string(role)) return role;
  }
  return std::nullopt;
}

Result<std::unique_ptr<Accounts>> Accounts::open(const std::filesystem::path& file,
                                                 const Clock& clock, AccountOptions options) {
  auto database = Database::open(file);
  if (!database) return forward(database);
  if (auto made = database->make_tables(schema, schema_version); !made) return forward(made);
  std::unique_ptr<Accounts> accounts(new Accounts(*std::move(database), clock, options));
  accounts->nobodys_hash_ = hash_password(random_hex(16), options.cost);
  return accounts;
}

std::int64_t Accounts::now_s() const {
  return std::chrono::duration_cast<std::chrono::seconds>(clock_.utc_now().time_since_epoch())
      .count();
}

Result<bool> Accounts::none() {
  const std::lock_guard lock(mutex_);
  Statement query = database_.statement("SELECT COUNT(*) FROM accounts");
  const std::int64_t count = query.next() ? query.integer() : 0;
  if (auto read = query.done(); !read) return forward(read);
  return count == 0;
}

Result<std::vector<Account>> Accounts::list() {
  const std::lock_guard lock(mutex_);
  std::vector<Account> found;
  Statement query =
      database_.statement("SELECT name, role, created, disabled FROM accounts ORDER BY name");
  while (query.next()) {
    Account& account = found.emplace_back();
    account.name = query.text();
    account.role = role_named(query.text()).value_or(Role::viewer);
    account.created = query.text();
    account.disabled = query.integer() != 0;
  }
  if (auto read = query.done(); !read) return forward(read);
  return found;
}

Result<Account> Accounts::account(const std::string& name) {
  Statement query =
      database_.statement("SELECT role, created, disabled FROM accounts WHERE name = ?");
  query.bind(name);
  if (!query.next()) {
    if (auto read = query.done(); !read) return forward(read);
    return fail(ErrorKind::usage, fmt::format("account \"{}\"", name), "does not exist");
  }
  Account account{name, role_named(query.text()).value_or(Role::viewer), {}, false};
  account.created = query.text();
  account.disabled = query.integer() != 0;
  return account;
}

Result<void> Accounts::add(const std::string& name, Role role, const std::string& password) {
  if (auto good = check_name(name); !good) return good;
  if (auto good = check_password(password); !good) return good;
  const std::string hash = hash_password(password, options_.cost);
  if (hash.empty()) {
    return fail(ErrorKind::no_result, "account", "there is not enough memory for its password");
  }
  const std::lock_guard lock(mutex_);
  if (account(name)) {
    return fail(ErrorKind::usage, fmt::format("account \"{}\"", name), "is there already");
  }
  return database_
      .statement("INSERT INTO accounts (name, role, password, created) VALUES (?, ?, ?, ?)")
      .bind(name)
      .bind(std::string_view(to_string(role)))
      .bind(hash)
      .bind(to_iso8601(clock_.utc_now()))
      .done();
}

/// Somebody must be able to let others in.
Result<void> Accounts::keep_an_administrator(const std::string& but_for) {
  Statement query = database_.statement(
      "SELECT COUNT(*) FROM accounts WHERE role = 'administrator' AND disabled = 0 AND name <> ?");
  query.bind(but_for);
  const std::int64_t others = query.next() ? query.integer() : 0;
  if (auto read = query.done(); !read) return read;
  if (others > 0) return {};
  return fail(ErrorKind::usage, fmt::format("account \"{}\"", but_for), "is the last administrator",
              "make another one first");
}

Result<void> Accounts::end_sign_ins(const std::string& name) {
  return database_.statement("DELETE FROM sign_ins WHERE account = ?").bind(name).done();
}

Result<void> Accounts::set_role(const std::string& name, Role role) {
  const std::lock_guard lock(mutex_);
  const auto known = account(name);
  if (!known) return forward(known);
  if (known->role == Role::administrator && role != Role::administrator && !known->disabled) {
    if (auto kept = keep_an_administrator(name); !kept) return kept;
  }
  return database_.statement("UPDATE accounts SET role = ? WHERE name = ?")
      .bind(std::string_view(to_string(role)))
      .bind(name)
      .done();
}

Result<void> Accounts::set_disabled(const std::string& name, bool disabled) {
  const std::lock_guard lock(mutex_);
  const auto known = account(name);
  if (!known) return forward(known);
  if (disabled && known->role == Role::administrator) {
    if (auto kept = keep_an_administrator(name); !kept) return kept;
  }
  Transaction transaction(database_);
  if (auto set = database_.statement("UPDATE accounts SET disabled = ? WHERE name = ?")
                     .bind(std::int64_t{disabled ? 1 : 0})
                     .bind(name)
                     .done();
      !set) {
    return set;
  }
  if (auto ended = end_sign_ins(name); !ended) return ended;
  return transaction.commit();
}

Result<void> Accounts::set_password(const std::string& name, const std::string& password) {
  if (auto good = check_password(password); !good) return good;
  const std::string hash = hash_password(password, options_.cost);
  if (hash.empty()) {
    return fail(ErrorKind::no_result, "account", "there is not enough memory for its password");
  }
  const std::lock_guard lock(mutex_);
  if (const auto known = account(name); !known) return forward(known);
  Transaction transaction(database_);
  if (auto set = database_.statement("UPDATE accounts SET password = ? WHERE name = ?")
                     .bind(hash)
                     .bind(name)
                     .done();
      !set) {
    return set;
  }
  if (auto ended = end_sign_ins(name); !ended) return ended;
  return transaction.commit();
}

Result<std::optional<Account>> Accounts::check(const std::string& name,
                                               const std::string& password) {
  std::string hash = nobodys_hash_;
  bool known = false;
  {
    const std::lock_guard lock(mutex_);
    Statement query =
        database_.statement("SELECT password FROM accounts WHERE name = ? AND disabled = 0");
    query.bind(name);
    if (query.next()) {
      known = true;
      hash = query.text();
    }
    if (auto read = query.done(); !read) return forward(read);
  }
  if (!is_password(password, hash) || !known) return std::nullopt;
  const std::lock_guard lock(mutex_);
  const auto found = account(name);
  if (!found || found->disabled) return std::nullopt;
  return *found;
}

Result<NewSignIn> Accounts::sign_in(const std::string& name) {
  const std::lock_guard lock(mutex_);
  const auto known = account(name);
  if (!known) return forward(known);
  NewSignIn made{random_hex(32), {name, known->role, random_hex(16)}};
  const std::int64_t longest = std::chrono::seconds(options_.longest).count();
  if (auto swept = database_.statement("DELETE FROM sign_ins WHERE begun_s < ?")
                       .bind(now_s() - longest)
                       .done();
      !swept) {
    return forward(swept);
  }
  if (auto kept = database_
                      .statement("INSERT INTO sign_ins (token_sha256, account, csrf, begun_s, "
                                 "seen_s) VALUES (?, ?, ?, ?, ?)")
                      .bind(sha256_hex(made.token))
                      .bind(name)
                      .bind(made.sign_in.csrf)
                      .bind(now_s())
                      .bind(now_s())
                      .done();
      !kept) {
    return forward(kept);
  }
  return made;
}

Result<std::optional<SignIn>> Accounts::signed_in(const std::string& token) {
  return find_sign_in(token, true);
}

Result<std::optional<SignIn>> Accounts::still_signed_in(const std::string& token) {
  return find_sign_in(token, false);
}

Result<std::optional<SignIn>> Accounts::find_sign_in(const std::string& token, bool sign_of_life) {
  constexpr std::int64_t seen_again_after_s = 30;  // not a write for every request
  if (token.empty()) return std::nullopt;
  const std::string sum = sha256_hex(token);
  const std::lock_guard lock(mutex_);
  SignIn found;
  std::int64_t begun_s = 0;
  std::int64_t seen_s = 0;
  {
    Statement query = database_.statement(
        "SELECT account, role, csrf, begun_s, seen_s FROM sign_ins JOIN accounts "
        "ON accounts.name = sign_ins.account WHERE token_sha256 = ? AND disabled = 0");
    query.bind(sum);
    if (!query.next()) {
      if (auto read = query.done(); !read) return forward(read);
      return std::nullopt;
    }
    found.account = query.text();
    found.role = role_named(query.text()).value_or(Role::viewer);
    found.csrf = query.text();
    begun_s = query.integer();
    seen_s = query.integer();
  }
  const std::int64_t now = now_s();
  const bool over = now - begun_s >= std::chrono::seconds(options_.longest).count() ||
                    now - seen_s >= std::chrono::seconds(options_.idle).count();
  if (over) {
    if (auto gone =
            database_.statement("DELETE FROM sign_ins WHERE token_sha256 = ?").bind(sum).done();
        !gone) {
      return forward(gone);
    }
    return std::nullopt;
  }
  if (sign_of_life && now - seen_s >= seen_again_after_s) {
    // A full disk must not lock out whoever could free it.
    static_cast<void>(database_.statement("UPDATE sign_ins SET seen_s = ? WHERE token_sha256 = ?")
                          .bind(now)
                          .bind(sum)
                          .done());
  }
  return found;
}

Result<void> Accounts::sign_out(const std::string& token) {
  const std::lock_guard lock(mutex_);
  return database_.statement("DELETE FROM sign_ins WHERE token_sha256 = ?")
      .bind(sha256_hex(token))
      .done();
}

}  // namespace skullstation
