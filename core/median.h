#pragma once

#include <vector>

namespace skullstation {

/// The middle value, of an even number the upper one of the two; 0 of none.
double median(std::vector<double> values);

}  // namespace skullstation
