#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/result.h"

namespace skullstation {

/// Numbers as they lie in a data set: one or two dimensions, row by row.
struct NumberTable {
  std::vector<double> values;
  Eigen::Index rows = 0;
  Eigen::Index columns = 1;
  bool flat = true;  ///< one dimension
};

enum class StoredNumber {
  float32,
  float64,
  int32,
  uint8,
  /// float32 rounded to `decimals` digits after the point and packed tightly (HDF5's scale-offset
  /// filter, which every reader undoes by itself).
  rounded
};

/// The content of an HDF5 file, written in memory: the same calls give the same bytes, since no
/// times are stored.
class Hdf5Writer {
 public:
  Hdf5Writer();
  ~Hdf5Writer();
  Hdf5Writer(const Hdf5Writer&) = delete;
  Hdf5Writer& operator=(const Hdf5Writer&) = delete;

  /// Groups on the way to `path` ("/skull/model/mean") are made as needed. Large tables are
  /// compressed.
  void table(const std::string& path, const NumberTable& numbers, StoredNumber as,
             int decimals = 6);
  void scalar(const std::string& path, double value, StoredNumber as);
  void text(const std::string& path, const std::string& value);
  void texts(const std::string& path, std::span<const std::string> values);
  /// Of a group, which is made as needed.
  void attribute(const std::string& group, const std::string& name, const std::string& value);

  /// The file's bytes; nothing can be written afterwards. Fails if HDF5 failed at any call.
  Result<std::string> finish();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// An HDF5 file in memory. Every failure names the file and the path in it.
class Hdf5Reader {
 public:
  /// `name` is what errors call the file.
  static Result<Hdf5Reader> open(std::string bytes, std::string name);
  Hdf5Reader(Hdf5Reader&&) noexcept;
  Hdf5Reader& operator=(Hdf5Reader&&) noexcept;
  ~Hdf5Reader();

  bool has(const std::string& path) const;
  /// At most 2^28 numbers.
  Result<NumberTable> table(const std::string& path) const;
  Result<double> scalar(const std::string& path) const;
  Result<std::string> text(const std::string& path) const;
  Result<std::vector<std::string>> texts(const std::string& path) const;
  Result<std::string> attribute(const std::string& group, const std::string& name) const;

 private:
  struct State;
  explicit Hdf5Reader(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace skullstation
