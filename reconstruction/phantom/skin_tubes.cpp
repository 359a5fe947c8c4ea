#include "reconstruction/phantom/skin_tables.h"

namespace skullstation {

namespace {

constexpr TubeRow::Tool kAdd = TubeRow::Tool::add;
constexpr TubeRow::Tool kCarve = TubeRow::Tool::carve;
constexpr bool kPaired = true;
constexpr bool kMedian = false;

// clang-format off
// Each point: centre [mm], radius [mm].
constexpr TubePoint kCranium[] = {
    {{0, -10, 44}, 70},
    {{0, 22, 46}, 70},};
constexpr TubePoint kFace[] = {
    {{0, -42, 12}, 49},
    {{0, -48, -28}, 49},};
constexpr TubePoint kNeck[] = {
    {{0, 22, -10}, 57},
    {{0, 22, -150}, 57},};
constexpr TubePoint kNose[] = {
    {{0, -82, 26}, 8.5},
    {{0, -106, -6}, 8.5},};
constexpr TubePoint kAuricle[] = {
    {{71, -3, 18}, 4.5},
    {{73.5, 0.5, 23.5}, 4.5},
    {{76.5, 6, 27}, 4.5},
    {{79.5, 12, 27.5}, 4.5},
    {{82, 17.5, 24}, 4.5},
    {{83, 21, 18}, 4.5},
    {{82.3, 21.5, 10}, 4.5},
    {{80, 19, 2}, 4.5},
    {{77.5, 14.5, -6}, 4.5},
    {{74.5, 9, -13}, 4.5},
    {{71.5, 3.5, -19}, 4.5},
    {{69, -1.5, -24}, 4.5},};
constexpr TubePoint kConcha[] = {
    {{70, 6, 8}, 6.5},
    {{74, 13, 12}, 6.5},};

// part, tool, side, blend [mm], points
constexpr TubeRow kRoughForms[] = {
    {"cranium", kAdd, kMedian, 0, kCranium},
    {"face", kAdd, kMedian, 40, kFace},
    {"neck", kAdd, kMedian, 40, kNeck},
    {"nose", kAdd, kMedian, 16, kNose},
    {"auricle", kAdd, kPaired, 3, kAuricle},
    {"concha", kAdd, kPaired, 4, kConcha},
};

constexpr TubePoint kUpperLid[] = {
    {{21.92, -74.81, 17.3}, 1.5},
    {{25.3, -77.58, 16.91}, 1.5},
    {{29.16, -78.36, 16.5}, 1.5},
    {{32.93, -78.68, 16.46}, 1.5},
    {{36.65, -77.95, 16.94}, 1.5},
    {{40.33, -75.54, 17.97}, 1.5},};
constexpr TubePoint kLidSlit[] = {
    {{18.67, -76.37, 17.71}, 0.5},
    {{21.47, -77.18, 16.72}, 0.7},
    {{24.98, -78.71, 15.61}, 0.8},
    {{28.98, -79.3, 14.99}, 0.8},
    {{33.01, -79.48, 14.87}, 0.8},
    {{37.05, -78.79, 15.47}, 0.8},
    {{41.09, -76.58, 16.81}, 0.7},
    {{44.59, -73.38, 18.62}, 0.5},};
constexpr TubePoint kLidCrease[] = {
    {{19.64, -74.89, 21.29}, 0.6},
    {{22.33, -78.25, 24.23}, 0.9},
    {{26.46, -79.51, 26.28}, 1.1},
    {{30.93, -80.25, 27}, 1.1},
    {{36.13, -79.69, 26.41}, 1.1},
    {{41.31, -77.37, 24.16}, 0.9},
    {{45.87, -73.26, 20.86}, 0.6},};
constexpr TubePoint kMouthSlit[] = {
    {{-26.61, -91.62, -39.94}, 0.6},
    {{-22.06, -95.61, -39.45}, 0.8},
    {{-16.04, -100.68, -38.76}, 0.9},
    {{-9.03, -104.51, -38.23}, 0.9},
    {{-4.03, -105.96, -38.42}, 0.9},
    {{0, -106.67, -38.9}, 0.9},
    {{4.03, -105.96, -38.42}, 0.9},
    {{9.03, -104.51, -38.23}, 0.9},
    {{16.04, -100.68, -38.76}, 0.9},
    {{22.06, -95.61, -39.45}, 0.8},
    {{26.61, -91.62, -39.94}, 0.6},};

constexpr TubeRow kFeatures[] = {
    {"upper lid margin", kAdd, kPaired, 1.5, kUpperLid},
    {"lid slit", kCarve, kPaired, 0.5, kLidSlit},
    {"lid crease", kCarve, kPaired, 2, kLidCrease},
    {"mouth slit", kCarve, kMedian, 1.2, kMouthSlit},
};
// clang-format on

}  // namespace

std::span<const TubeRow> skin_rough_forms() { return kRoughForms; }

std::span<const TubeRow> skin_features() { return kFeatures; }

}  // namespace skullstation
