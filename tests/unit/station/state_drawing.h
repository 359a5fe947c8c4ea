#pragma once

#include <string>

namespace skullstation::testing {

/// The station's transitions as a Mermaid state diagram.
std::string state_diagram();

/// The same as a Markdown table: a row a state, a column an event that a person causes or sees.
std::string state_matrix();

}  // namespace skullstation::testing
