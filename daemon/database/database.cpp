#include "daemon/database/database.h"

#include <fmt/format.h>
#include <sqlite3.h>

#include <utility>

namespace skullstation {

namespace {

tl::unexpected<Error> database_error(sqlite3* database, int status) {
  const char* file = database == nullptr ? nullptr : sqlite3_db_filename(database, "main");
  const std::string advice =
      status == SQLITE_FULL ? "free some space on this volume"
      : status == SQLITE_CORRUPT || status == SQLITE_NOTADB
          ? "put back a copy of it; the pictures and models beside it are intact"
          : "";
  return fail(ErrorKind::bad_input, file == nullptr ? "database" : file,
              fmt::format("the database says: {}",
                          database == nullptr ? sqlite3_errstr(status) : sqlite3_errmsg(database)),
              advice);
}

}  // namespace

Statement::Statement(sqlite3* database, std::string_view sql)
    : database_(database),
      status_(sqlite3_prepare_v2(database, sql.data(), static_cast<int>(sql.size()), &statement_,
                                 nullptr)) {}

Statement::~Statement() { sqlite3_finalize(statement_); }

Statement& Statement::bind(std::int64_t value) {
  if (status_ == SQLITE_OK) status_ = sqlite3_bind_int64(statement_, ++parameter_, value);
  return *this;
}

Statement& Statement::bind(double value) {
  if (status_ == SQLITE_OK) status_ = sqlite3_bind_double(statement_, ++parameter_, value);
  return *this;
}

Statement& Statement::bind(std::string_view value) {
  if (status_ == SQLITE_OK) {
    status_ = sqlite3_bind_text64(statement_, ++parameter_, value.data(), value.size(),
                                  SQLITE_TRANSIENT, SQLITE_UTF8);
  }
  return *this;
}

Statement& Statement::bind_optional(const std::optional<std::string>& value) {
  if (value) return bind(*value);
  if (status_ == SQLITE_OK) status_ = sqlite3_bind_null(statement_, ++parameter_);
  return *this;
}

bool Statement::next() {
  column_ = 0;
  if (status_ == SQLITE_OK || status_ == SQLITE_ROW) status_ = sqlite3_step(statement_);
  return status_ == SQLITE_ROW;
}

bool Statement::is_null() { return sqlite3_column_type(statement_, column_) == SQLITE_NULL; }

std::int64_t Statement::integer() { return sqlite3_column_int64(statement_, column_++); }

double Statement::number() { return sqlite3_column_double(statement_, column_++); }

std::string Statement::text() {
  const auto* bytes = sqlite3_column_text(statement_, column_);
  const auto size = static_cast<std::size_t>(sqlite3_column_bytes(statement_, column_++));
  return bytes == nullptr ? std::string{} : std::string(reinterpret_cast<const char*>(bytes), size);
}

std::optional<std::string> Statement::optional_text() {
  if (!is_null()) return text();
  ++column_;
  return std::nullopt;
}

Result<void> Statement::done() {
  while (next()) {
  }
  if (status_ != SQLITE_DONE) return database_error(database_, status_);
  return {};
}

Result<Database> Database::open(const std::filesystem::path& file) {
  sqlite3* handle = nullptr;
  const int status =
      sqlite3_open_v2(file.c_str(), &handle, SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE, nullptr);
  Database database(handle);
  if (status != SQLITE_OK) return database_error(handle, status);
  sqlite3_busy_timeout(handle, 5000);  // somebody looks at it with another program
  if (auto set = database.execute("PRAGMA journal_mode = WAL; PRAGMA synchronous = FULL; "
                                  "PRAGMA foreign_keys = ON; PRAGMA trusted_schema = OFF;");
      !set) {
    return forward(set);
  }
  return database;
}

Database::~Database() { sqlite3_close(handle_); }

Database::Database(Database&& other) noexcept : handle_(std::exchange(other.handle_, nullptr)) {}

Result<void> Database::make_tables(const std::string& schema, int version) {
  Transaction transaction(*this);  // another program may be about to make them too
  std::int64_t found = 0;
  Statement query = statement("PRAGMA user_version");
  if (query.next()) found = query.integer();
  if (auto read = query.done(); !read) return read;
  if (found == version) return {};
  if (found != 0) {
    return fail(ErrorKind::bad_input, sqlite3_db_filename(handle_, "main"),
                fmt::format("has format {}; this program knows {}", found, version),
                "install the version of Skullstation that wrote it");
  }
  if (auto made = execute(schema + fmt::format("PRAGMA user_version = {};", version)); !made) {
    return made;
  }
  return transaction.commit();
}

Result<void> Database::execute(const std::string& sql) {
  const int status = sqlite3_exec(handle_, sql.c_str(), nullptr, nullptr, nullptr);
  if (status != SQLITE_OK) return database_error(handle_, status);
  return {};
}

std::int64_t Database::last_id() const { return sqlite3_last_insert_rowid(handle_); }

int Database::changed_rows() const { return sqlite3_changes(handle_); }

std::string Database::damage() {
  Statement check = statement("PRAGMA integrity_check");
  std::string found;
  while (check.next()) {
    const std::string line = check.text();
    if (line != "ok") found += line + "\n";
  }
  if (const auto read = check.done(); !read) found += read.error().message();
  return found;
}

Transaction::Transaction(Database& database)
    : database_(database), begun_(database.execute("BEGIN IMMEDIATE")), open_(begun_.has_value()) {}

Transaction::~Transaction() {
  // A rollback fails only where SQLite has already rolled back by itself (disk full).
  if (open_) static_cast<void>(database_.execute("ROLLBACK"));
}

Result<void> Transaction::commit() {
  if (!begun_) return begun_;
  if (auto committed = database_.execute("COMMIT"); !committed) return committed;
  open_ = false;
  return {};
}

}  // namespace skullstation
