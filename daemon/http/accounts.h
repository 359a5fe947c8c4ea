#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/clock.h"
#include "core/result.h"
#include "daemon/database/database.h"
#include "daemon/http/password.h"

namespace skullstation {

/// What somebody may do (daemon/http/routes.cpp has the table).
enum class Role { viewer, operates, examiner, administrator, auditor };

/// "viewer", "operator", "examiner", "administrator", "auditor".
const char* to_string(Role role);
std::optional<Role> role_named(std::string_view name);

struct Account {
  std::string name;
  Role role = Role::viewer;
  std::string created;  ///< UTC, ISO 8601
  bool disabled = false;
};

/// Somebody who has signed in.
struct SignIn {
  std::string account;
  Role role = Role::viewer;
  std::string csrf;  ///< what every request that changes something must show
};

struct NewSignIn {
  std::string token;  ///< the cookie's value
  SignIn sign_in;
};

struct AccountOptions {
  PasswordCost cost;
  std::chrono::minutes idle{60};   ///< a sign-in ends after so long without a request
  std::chrono::hours longest{12};  ///< and after so long in any case
};

/// The accounts of a station and who is signed in, in a SQLite file. Of passwords only Argon2id
/// hashes are kept, of sign-ins only the sum of their token. Safe from any thread.
class Accounts {
 public:
  static Result<std::unique_ptr<Accounts>> open(const std::filesystem::path& file,
                                                const Clock& clock, AccountOptions options = {});

  Result<bool> none();
  Result<std::vector<Account>> list();
  /// Errors (bad_input): a name that is not 1 to 32 letters, digits, '.', '-' and '_', or a
  /// password shorter than 10 or longer than 200 characters; (usage): the name is taken.
  Result<void> add(const std::string& name, Role role, const std::string& password);
  /// Errors (usage): no such account, or it is the last administrator who is not disabled.
  Result<void> set_role(const std::string& name, Role role);
  Result<void> set_disabled(const std::string& name, bool disabled);
  /// Ends the account's sign-ins, too.
  Result<void> set_password(const std::string& name, const std::string& password);

  /// Absent: wrong password, no such account, or disabled; each takes as long.
  Result<std::optional<Account>> check(const std::string& name, const std::string& password);

  Result<NewSignIn> sign_in(const std::string& name);
  /// Who holds this token; counts as a sign of life. Absent: nobody (any more).
  Result<std::optional<SignIn>> signed_in(const std::string& token);
  /// The same without being a sign of life: for who only looks on.
  Result<std::optional<SignIn>> still_signed_in(const std::string& token);
  Result<void> sign_out(const std::string& token);

 private:
  Accounts(Database database, const Clock& clock, AccountOptions options)
      : database_(std::move(database)), clock_(clock), options_(options) {}
  Result<Account> account(const std::string& name);
  Result<void> keep_an_administrator(const std::string& but_for);
  Result<std::optional<SignIn>> find_sign_in(const std::string& token, bool sign_of_life);
  Result<void> end_sign_ins(const std::string& name);
  std::int64_t now_s() const;

  std::mutex mutex_;
  Database database_;
  const Clock& clock_;
  const AccountOptions options_;
  std::string nobodys_hash_;  // checked for names that don't exist
};

}  // namespace skullstation
