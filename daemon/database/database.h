#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "core/result.h"

struct sqlite3;
struct sqlite3_stmt;

namespace skullstation {

/// One row at a time of a query. The first failure is kept and told by done(), so that the code
/// between stays linear: what is bound or read after a failure does nothing.
class Statement {
 public:
  Statement(sqlite3* database, std::string_view sql);
  ~Statement();
  Statement(const Statement&) = delete;
  Statement& operator=(const Statement&) = delete;

  /// Binds the next parameter.
  Statement& bind(std::int64_t value);
  Statement& bind(double value);
  Statement& bind(std::string_view value);
  Statement& bind_optional(const std::optional<std::string>& value);

  /// Goes to the next row; false after the last one, or after a failure.
  bool next();
  /// Reads the next column of the row.
  std::int64_t integer();
  double number();
  std::string text();
  std::optional<std::string> optional_text();

  /// Steps to the end; then how it went.
  Result<void> done();

 private:
  bool is_null();

  sqlite3* database_;
  sqlite3_stmt* statement_ = nullptr;
  int status_;
  int parameter_ = 0;
  int column_ = 0;
};

/// A SQLite database: write-ahead log, every commit on the disk when it returns (synchronous FULL),
/// foreign keys enforced. Not safe to use from two threads at once.
class Database {
 public:
  /// Opens or makes the file. Errors (bad_input): can't be opened, is not a database, is damaged.
  static Result<Database> open(const std::filesystem::path& file);
  ~Database();
  Database(Database&& other) noexcept;
  Database& operator=(Database&&) = delete;
  Database(const Database&) = delete;
  Database& operator=(const Database&) = delete;

  /// Makes the tables of a new file by `schema` and marks it with `version` (from 1); a file that
  /// has them already is left as it is. Errors (bad_input): the file is of another version.
  Result<void> make_tables(const std::string& schema, int version);
  /// Several statements without parameters.
  Result<void> execute(const std::string& sql);
  Statement statement(std::string_view sql) { return {handle_, sql}; }
  std::int64_t last_id() const;
  int changed_rows() const;
  /// Empty if SQLite's own integrity check finds nothing.
  std::string damage();

 private:
  explicit Database(sqlite3* handle) : handle_(handle) {}
  sqlite3* handle_;
};

/// Everything until commit() or, without it, nothing.
class Transaction {
 public:
  explicit Transaction(Database& database);
  ~Transaction();
  Transaction(const Transaction&) = delete;
  Transaction& operator=(const Transaction&) = delete;

  /// The error of its beginning, if that failed.
  Result<void> commit();

 private:
  Database& database_;
  Result<void> begun_;
  bool open_;
};

}  // namespace skullstation
