#include "reconstruction/phantom/skin_thickness.h"

namespace skullstation {

namespace {

constexpr TissueDepth kDepths[] = {
    {"opisthocranion", false, 6.0, 2.0, {0, 1, 0}},
    {"vertex", false, 5.0, 1.5, {0, 0, 1}},
    {"glabella", false, 5.5, 1.0, {0, -1, 0.05}},
    {"nasion", false, 6.0, 1.5, {0, -1, 0.1}},
    {"midnasale", false, 4.5, 1.5, {0, -0.85, 0.53}},
    {"rhinion", false, 3.0, 1.0, {0, -0.85, 0.53}},
    {"subspinale", false, 13.5, 3.5, {0, -1, 0.06}},
    {"mid-philtrum", false, 11.5, 2.5, {0, -1, -0.03}},
    {"prosthion", false, 12.0, 3.0, {0, -0.95, -0.3}},
    {"infradentale", false, 13.5, 3.0, {0, -0.97, 0.22}},
    {"supramentale", false, 11.0, 2.0, {0, -1, 0}},
    {"pogonion", false, 11.0, 2.5, {0, -1, -0.05}},
    {"gnathion", false, 7.5, 2.5, {0, -0.75, -0.66}},
    {"menton", false, 7.0, 2.5, {0, -0.1, -1}},
    {"mid-supraorbitale", true, 7.0, 2.0, {0.1, -0.98, 0.15}},
    {"mid-infraorbitale", true, 6.5, 3.0, {0.15, -0.97, -0.15}},
    {"alar curvature point", true, 10.0, 3.0, {0.5, -0.86, 0}},
    {"gonion", true, 12.5, 6.0, {0.75, 0.4, -0.52}},
    {"zygion", true, 7.5, 3.0, {1, 0, 0}},
    {"supra-canine", true, 10.5, 2.5, {0.45, -0.89, 0}},
    {"infra-canine", true, 11.0, 2.5, {0.45, -0.89, 0}},
    {"supra-M2", true, 26.0, 7.0, {0.92, -0.4, 0}},
    {"infra-M2", true, 22.0, 6.5, {0.92, -0.4, 0}},
    {"mid-ramus", true, 19.5, 5.0, {1, -0.05, 0}},
    {"mid-mandibular border", true, 11.0, 4.0, {0.6, -0.1, -0.8}},
};

}  // namespace

std::span<const TissueDepth> tissue_depths() { return kDepths; }

}  // namespace skullstation
