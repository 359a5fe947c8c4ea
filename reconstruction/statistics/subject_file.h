#pragma once

#include <string>

#include "core/result.h"
#include "reconstruction/statistics/population.h"

namespace skullstation {

/// A fitted subject as kept between runs (HDF5), with the key of what it was made from.
struct StoredSubject {
  std::string key;
  ModelSubject subject;
};

Result<std::string> encode_subject(const StoredSubject& stored);

/// `name` is what errors call the file.
Result<StoredSubject> decode_subject(std::string bytes, const std::string& name);

}  // namespace skullstation
