#include "reconstruction/statistics/hdf5_group.h"

#include <fmt/format.h>
#include <hdf5.h>
#include <hdf5_hl.h>

#include <algorithm>
#include <array>
#include <utility>

namespace skullstation {

namespace {

constexpr hsize_t most_numbers = hsize_t{1} << 28;
constexpr hsize_t worth_compressing = 4096;
constexpr hsize_t most_texts = 1 << 20;

/// A handle of HDF5's, closed by the function that belongs to it.
class Handle {
 public:
  Handle() = default;
  Handle(hid_t id, herr_t (*with)(hid_t)) : id_(id), close_(with) {}
  Handle(Handle&& o) noexcept : id_(std::exchange(o.id_, -1)), close_(o.close_) {}
  Handle& operator=(Handle&& o) noexcept {
    std::swap(id_, o.id_);
    std::swap(close_, o.close_);
    return *this;
  }
  ~Handle() { close(); }
  Handle(const Handle&) = delete;
  Handle& operator=(const Handle&) = delete;

  hid_t id() const { return id_; }
  bool good() const { return id_ >= 0; }
  void close() {
    if (id_ >= 0) close_(id_);
    id_ = -1;
  }

 private:
  hid_t id_ = -1;
  herr_t (*close_)(hid_t) = nullptr;
};

/// HDF5 prints what goes wrong; we say it ourselves.
void be_quiet() { H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr); }

hid_t stored_type(StoredNumber as) {
  switch (as) {
    case StoredNumber::float32:
    case StoredNumber::rounded: return H5T_IEEE_F32LE;
    case StoredNumber::float64: return H5T_IEEE_F64LE;
    case StoredNumber::int32: return H5T_STD_I32LE;
    case StoredNumber::uint8: return H5T_STD_U8LE;
  }
  return H5T_IEEE_F64LE;
}

Handle text_type(std::size_t length) {
  Handle type(H5Tcopy(H5T_C_S1), H5Tclose);
  H5Tset_size(type.id(), std::max<std::size_t>(1, length));
  H5Tset_cset(type.id(), H5T_CSET_UTF8);
  H5Tset_strpad(type.id(), H5T_STR_NULLPAD);
  return type;
}

/// Blocks of rows of about a megabyte.
std::array<hsize_t, 2> chunk_of(hsize_t rows, hsize_t columns) {
  const hsize_t wide = std::min<hsize_t>(columns, 1 << 16);
  return {std::clamp<hsize_t>((1 << 18) / wide, 1, rows), wide};
}

}  // namespace

struct Hdf5Writer::State {
  Handle file;
  Handle with_parents;  // link creation: intermediate groups
  std::string failed;   // the first path that could not be written

  void check(bool good, const std::string& path) {
    if (!good && failed.empty()) failed = path;
  }
  /// A data set without times, compressed where that pays.
  Handle data_set(const std::string& path, hid_t type, hid_t space, std::span<const hsize_t> size,
                  StoredNumber as, int decimals) {
    const Handle properties(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
    H5Pset_obj_track_times(properties.id(), 0);
    hsize_t count = 1;
    for (const hsize_t n : size) count *= n;
    if (count >= worth_compressing) {
      const auto chunk = chunk_of(size[0], size.size() > 1 ? size[1] : 1);
      H5Pset_chunk(properties.id(), static_cast<int>(size.size()), chunk.data());
      if (as == StoredNumber::rounded) {
        H5Pset_scaleoffset(properties.id(), H5Z_SO_FLOAT_DSCALE, decimals);
      } else {
        H5Pset_shuffle(properties.id());
      }
      H5Pset_deflate(properties.id(), 6);
    }
    Handle set(H5Dcreate2(file.id(), path.c_str(), type, space, with_parents.id(), properties.id(),
                          H5P_DEFAULT),
               H5Dclose);
    check(set.good(), path);
    return set;
  }
};

Hdf5Writer::Hdf5Writer() : state_(std::make_unique<State>()) {
  be_quiet();
  const Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  H5Pset_fapl_core(access.id(), 1 << 22, 0);
  const Handle creation(H5Pcreate(H5P_FILE_CREATE), H5Pclose);
  H5Pset_obj_track_times(creation.id(), 0);
  state_->file =
      Handle(H5Fcreate("in memory", H5F_ACC_TRUNC, creation.id(), access.id()), H5Fclose);
  state_->with_parents = Handle(H5Pcreate(H5P_LINK_CREATE), H5Pclose);
  H5Pset_create_intermediate_group(state_->with_parents.id(), 1);
  H5Pset_char_encoding(state_->with_parents.id(), H5T_CSET_UTF8);
  state_->check(state_->file.good(), "/");
}

Hdf5Writer::~Hdf5Writer() = default;

void Hdf5Writer::table(const std::string& path, const NumberTable& numbers, StoredNumber as,
                       int decimals) {
  const std::array<hsize_t, 2> size = {static_cast<hsize_t>(numbers.rows),
                                       static_cast<hsize_t>(numbers.columns)};
  const int dimensions = numbers.flat ? 1 : 2;
  const Handle space(H5Screate_simple(dimensions, size.data(), nullptr), H5Sclose);
  const Handle set =
      state_->data_set(path, stored_type(as), space.id(),
                       std::span(size).first(static_cast<std::size_t>(dimensions)), as, decimals);
  if (!set.good() || numbers.values.empty()) return;
  state_->check(H5Dwrite(set.id(), H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT,
                         numbers.values.data()) >= 0,
                path);
}

void Hdf5Writer::scalar(const std::string& path, double value, StoredNumber as) {
  const Handle space(H5Screate(H5S_SCALAR), H5Sclose);
  const Handle set = state_->data_set(path, stored_type(as), space.id(), {}, as, 0);
  if (!set.good()) return;
  state_->check(H5Dwrite(set.id(), H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, &value) >= 0,
                path);
}

void Hdf5Writer::text(const std::string& path, const std::string& value) {
  const Handle space(H5Screate(H5S_SCALAR), H5Sclose);
  const Handle type = text_type(value.size());
  const Handle set = state_->data_set(path, type.id(), space.id(), {}, StoredNumber::uint8, 0);
  if (!set.good()) return;
  const std::string padded = value.empty() ? std::string(1, '\0') : value;
  state_->check(H5Dwrite(set.id(), type.id(), H5S_ALL, H5S_ALL, H5P_DEFAULT, padded.data()) >= 0,
                path);
}

void Hdf5Writer::texts(const std::string& path, std::span<const std::string> values) {
  std::size_t longest = 1;
  for (const std::string& value : values) longest = std::max(longest, value.size());
  std::string padded;
  for (const std::string& value : values) {
    padded += value;
    padded.append(longest - value.size(), '\0');
  }
  const std::array<hsize_t, 1> size = {values.size()};
  const Handle space(H5Screate_simple(1, size.data(), nullptr), H5Sclose);
  const Handle type = text_type(longest);
  const Handle set = state_->data_set(path, type.id(), space.id(), {}, StoredNumber::uint8, 0);
  if (!set.good() || values.empty()) return;
  state_->check(H5Dwrite(set.id(), type.id(), H5S_ALL, H5S_ALL, H5P_DEFAULT, padded.data()) >= 0,
                path);
}

void Hdf5Writer::attribute(const std::string& group, const std::string& name,
                           const std::string& value) {
  if (H5Lexists(state_->file.id(), group.c_str(), H5P_DEFAULT) <= 0 && group != "/") {
    const Handle made(H5Gcreate2(state_->file.id(), group.c_str(), state_->with_parents.id(),
                                 H5P_DEFAULT, H5P_DEFAULT),
                      H5Gclose);
    state_->check(made.good(), group);
  }
  state_->check(
      H5LTset_attribute_string(state_->file.id(), group.c_str(), name.c_str(), value.c_str()) >= 0,
      group + "@" + name);
}

Result<std::string> Hdf5Writer::finish() {
  const auto failed = [](const std::string& path) {
    return fail(ErrorKind::no_result, "HDF5", "could not write " + path, "check the free memory");
  };
  if (!state_->failed.empty()) return failed(state_->failed);
  H5Fflush(state_->file.id(), H5F_SCOPE_GLOBAL);
  const ssize_t size = H5Fget_file_image(state_->file.id(), nullptr, 0);
  if (size <= 0) return failed("/");
  std::string bytes(static_cast<std::size_t>(size), '\0');
  if (H5Fget_file_image(state_->file.id(), bytes.data(), bytes.size()) != size) return failed("/");
  state_->file.close();
  return bytes;
}

struct Hdf5Reader::State {
  std::string name;
  Handle file;

  tl::unexpected<Error> bad(const std::string& path, const std::string& what) const {
    return fail(ErrorKind::bad_input, name + ":" + path, what);
  }
  bool has(const std::string& path) const {
    // Each step of the way has to be asked for.
    for (std::size_t end = path.find('/', 1); end != std::string::npos;
         end = path.find('/', end + 1)) {
      if (H5Lexists(file.id(), path.substr(0, end).c_str(), H5P_DEFAULT) <= 0) return false;
    }
    return H5Lexists(file.id(), path.c_str(), H5P_DEFAULT) > 0;
  }
  Handle open(const std::string& path) const {
    if (!has(path)) return {};
    return {H5Dopen2(file.id(), path.c_str(), H5P_DEFAULT), H5Dclose};
  }
};

Hdf5Reader::Hdf5Reader(std::unique_ptr<State> state) : state_(std::move(state)) {}
Hdf5Reader::Hdf5Reader(Hdf5Reader&&) noexcept = default;
Hdf5Reader& Hdf5Reader::operator=(Hdf5Reader&&) noexcept = default;
Hdf5Reader::~Hdf5Reader() = default;

Result<Hdf5Reader> Hdf5Reader::open(std::string bytes, std::string name) {
  be_quiet();
  auto state = std::make_unique<State>();
  state->name = std::move(name);
  // Not H5LTopen_file_image, which leaks a little with each file (HDF5 1.10). HDF5 takes two open
  // images of one name for one file, so the name is the state's own place.
  const Handle in_memory(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  H5Pset_fapl_core(in_memory.id(), std::size_t{1} << 16, /*backing_store=*/0);
  H5Pset_file_image(in_memory.id(), bytes.data(), bytes.size());
  state->file = Handle(
      H5Fopen(fmt::format("{}", fmt::ptr(state.get())).c_str(), H5F_ACC_RDONLY, in_memory.id()),
      H5Fclose);
  if (!state->file.good()) {
    return fail(ErrorKind::bad_input, state->name,
                "is not a whole HDF5 file: it is of another kind or was cut off", "copy it again");
  }
  return Hdf5Reader(std::move(state));
}

bool Hdf5Reader::has(const std::string& path) const { return state_->has(path); }

Result<NumberTable> Hdf5Reader::table(const std::string& path) const {
  const Handle set = state_->open(path);
  if (!set.good()) return state_->bad(path, "is missing");
  const Handle space(H5Dget_space(set.id()), H5Sclose);
  const Handle type(H5Dget_type(set.id()), H5Tclose);
  const H5T_class_t kind = H5Tget_class(type.id());
  if (kind != H5T_INTEGER && kind != H5T_FLOAT) return state_->bad(path, "does not hold numbers");
  const int dimensions = H5Sget_simple_extent_ndims(space.id());
  std::array<hsize_t, 2> size = {1, 1};
  if (dimensions < 0 || dimensions > 2) return state_->bad(path, "has more than two dimensions");
  H5Sget_simple_extent_dims(space.id(), size.data(), nullptr);
  if (size[0] > most_numbers || size[1] > most_numbers || size[0] * size[1] > most_numbers) {
    return state_->bad(path, fmt::format("claims {} x {} numbers", size[0], size[1]));
  }
  NumberTable numbers;
  numbers.rows = static_cast<Eigen::Index>(size[0]);
  numbers.columns = static_cast<Eigen::Index>(size[1]);
  numbers.flat = dimensions < 2;
  numbers.values.resize(size[0] * size[1]);
  if (!numbers.values.empty() && H5Dread(set.id(), H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT,
                                         numbers.values.data()) < 0) {
    return state_->bad(path, "is damaged");
  }
  return numbers;
}

Result<double> Hdf5Reader::scalar(const std::string& path) const {
  const auto numbers = table(path);
  if (!numbers) return forward(numbers);
  if (numbers->values.size() != 1) return state_->bad(path, "is not one number");
  return numbers->values.front();
}

Result<std::string> Hdf5Reader::text(const std::string& path) const {
  const auto all = texts(path);
  if (!all) return forward(all);
  if (all->size() != 1) return state_->bad(path, "is not one text");
  return all->front();
}

Result<std::vector<std::string>> Hdf5Reader::texts(const std::string& path) const {
  const Handle set = state_->open(path);
  if (!set.good()) return state_->bad(path, "is missing");
  const Handle type(H5Dget_type(set.id()), H5Tclose);
  if (H5Tget_class(type.id()) != H5T_STRING || H5Tis_variable_str(type.id()) > 0) {
    return state_->bad(path, "does not hold text of fixed length");
  }
  const Handle space(H5Dget_space(set.id()), H5Sclose);
  const auto count =
      static_cast<std::size_t>(std::max<hssize_t>(0, H5Sget_simple_extent_npoints(space.id())));
  const std::size_t length = H5Tget_size(type.id());
  if (count > most_texts || length > most_numbers || count * length > most_numbers) {
    return state_->bad(path, fmt::format("claims {} texts of {} bytes", count, length));
  }
  std::string padded(count * length, '\0');
  if (count > 0 && H5Dread(set.id(), type.id(), H5S_ALL, H5S_ALL, H5P_DEFAULT, padded.data()) < 0) {
    return state_->bad(path, "is damaged");
  }
  std::vector<std::string> values;
  for (std::size_t i = 0; i < count; ++i) {
    const std::string padded_value = padded.substr(i * length, length);
    values.push_back(padded_value.substr(0, padded_value.find('\0')));
  }
  return values;
}

Result<std::string> Hdf5Reader::attribute(const std::string& group, const std::string& name) const {
  const std::string path = group + "@" + name;
  if ((group != "/" && !has(group)) ||
      H5Aexists_by_name(state_->file.id(), group.c_str(), name.c_str(), H5P_DEFAULT) <= 0) {
    return state_->bad(path, "is missing");
  }
  const Handle attribute(
      H5Aopen_by_name(state_->file.id(), group.c_str(), name.c_str(), H5P_DEFAULT, H5P_DEFAULT),
      H5Aclose);
  const Handle type(H5Aget_type(attribute.id()), H5Tclose);
  if (H5Tget_class(type.id()) != H5T_STRING) return state_->bad(path, "is not text");
  if (H5Tis_variable_str(type.id()) > 0) {
    char* value = nullptr;
    if (H5Aread(attribute.id(), type.id(), static_cast<void*>(&value)) < 0 || value == nullptr) {
      return state_->bad(path, "is damaged");
    }
    std::string copy(value);
    H5free_memory(value);
    return copy;
  }
  const std::size_t length = H5Tget_size(type.id());
  if (length > most_texts) return state_->bad(path, "is too long");
  std::string value(length, '\0');
  if (H5Aread(attribute.id(), type.id(), value.data()) < 0) return state_->bad(path, "is damaged");
  return value.substr(0, value.find('\0'));
}

}  // namespace skullstation
