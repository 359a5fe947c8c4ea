#include "reconstruction/phantom/thickness_table.h"

namespace skullstation {

namespace {

// clang-format off
constexpr TissueThickness kRows[] = {
    {"op-op'", "opisthocranion", false, 6.0, 2.0, {0, 1, 0}, 0.40, 0.10, 0.00},
    {"v-v'", "vertex", false, 5.0, 1.5, {0, 0, 1}, 0.35, 0.10, 0.00},
    {"g-g'", "glabella", false, 5.5, 1.0, {0, -1, 0.05}, 0.35, 0.10, 0.00},
    {"n-se'", "nasion", false, 6.0, 1.5, {0, -1, 0.1}, 0.35, 0.15, 0.00},
    {"mn-mn'", "midnasale", false, 4.5, 1.5, {0, -0.85, 0.53}, 0.30, 0.10, 0.00},
    {"rhi-rhi'", "rhinion", false, 3.0, 1.0, {0, -0.85, 0.53}, 0.25, 0.05, 0.00},
    {"ss-sn'", "subspinale", false, 13.5, 3.5, {0, -1, 0.06}, 0.20, 0.25, -0.10},
    {"mp-mp'", "mid-philtrum", false, 11.5, 2.5, {0, -1, -0.03}, 0.20, 0.30, -0.20},
    {"pr-ls'", "prosthion", false, 12.0, 3.0, {0, -0.95, -0.3}, 0.20, 0.30, -0.25},
    {"id-li'", "infradentale", false, 13.5, 3.0, {0, -0.97, 0.22}, 0.25, 0.25, -0.20},
    {"sm-sm'", "supramentale", false, 11.0, 2.0, {0, -1, 0}, 0.30, 0.20, 0.00},
    {"pg-pg'", "pogonion", false, 11.0, 2.5, {0, -1, -0.05}, 0.45, 0.10, 0.05},
    {"gn-gn'", "gnathion", false, 7.5, 2.5, {0, -0.75, -0.66}, 0.55, 0.10, 0.05},
    {"me-me'", "menton", false, 7.0, 2.5, {0, -0.1, -1}, 0.55, 0.10, 0.05},
    {"mso-mso'", "mid-supraorbitale", true, 7.0, 2.0, {0.1, -0.98, 0.15}, 0.35, 0.10, -0.05},
    {"mio-mio'", "mid-infraorbitale", true, 6.5, 3.0, {0.15, -0.97, -0.15}, 0.45, -0.05, 0.05},
    {"ac-ac'", "alar curvature point", true, 10.0, 3.0, {0.5, -0.86, 0}, 0.35, 0.15, 0.05},
    {"go-go'", "gonion", true, 12.5, 6.0, {0.75, 0.4, -0.52}, 0.65, 0.10, 0.05},
    {"zy-zy'", "zygion", true, 7.5, 3.0, {1, 0, 0}, 0.60, -0.05, -0.05},
    {"sC-sC'", "supra-canine", true, 10.5, 2.5, {0.45, -0.89, 0}, 0.30, 0.25, -0.10},
    {"iC-iC'", "infra-canine", true, 11.0, 2.5, {0.45, -0.89, 0}, 0.35, 0.20, -0.05},
    {"ecm2-sM2'", "supra-M2", true, 26.0, 7.0, {0.92, -0.4, 0}, 0.65, 0.05, -0.05},
    {"ecm2-iM2'", "infra-M2", true, 22.0, 6.5, {0.92, -0.4, 0}, 0.65, 0.05, 0.00},
    {"mr-mr'", "mid-ramus", true, 19.5, 5.0, {1, -0.05, 0}, 0.60, 0.15, 0.00},
    {"mmb-mmb'", "mid-mandibular border", true, 11.0, 4.0, {0.6, -0.1, -0.8}, 0.65, 0.10, 0.10},
};
// clang-format on

}  // namespace

std::span<const TissueThickness> thickness_table() { return kRows; }

}  // namespace skullstation
