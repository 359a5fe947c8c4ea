#include "reconstruction/phantom/person_ct.h"

#include <string>

#include "reconstruction/phantom/bone_warp.h"

namespace skullstation {

using Eigen::Vector3d;

namespace {

/// The point that a gentle warp takes to `target`, to a few hundredths of a millimetre: tissues are
/// told apart by it, no surface lies there.
Vector3d source_nearby(const SpaceWarp& warp, const Vector3d& target) {
  Vector3d point = warp.motion.inverse() * target;
  for (int step = 0; step < 12; ++step) {
    const Vector3d miss = warp.motion.rotation.conjugate() * (target - warp(point));
    point += miss;
    if (miss.squaredNorm() < 0.03 * 0.03) break;
  }
  return point;
}

}  // namespace

PhantomBody body_of(const Person& person) {
  PhantomBody body;
  body.bone = person.skull;
  body.skin = person.skin;
  body.open_from_closed = person.bone.open_from_closed;
  body.canonical_from_patient = [&person](const Vector3d& patient) {
    const Vector3d skull = source_nearby(person.bone.person_from_canonical, patient);
    return CanonicalPlace{skull, source_nearby(person.face.face_from_canonical, skull)};
  };
  return body;
}

Result<void> add_flaw(PhantomCtOptions& options, const Person& person, std::string_view word) {
  constexpr std::int16_t kPadding_hu = -2000;
  if (word == "cropped-calvaria") {
    options.cropped_calvaria_mm = 25.0;
  } else if (word == "cropped-nose") {
    options.cropped_nose_mm = 12.0;
  } else if (word == "head-rest") {
    options.head_rest = true;
  } else if (word == "table") {
    options.table = true;
  } else if (word == "padding") {
    options.padding_hu = kPadding_hu;
  } else if (word == "metal") {
    // In the crowns behind the canines: on the line from the gums to the teeth of the other jaw.
    for (const char* side : {" left", " right"}) {
      const auto at = [&](const std::string& name) {
        return person.bone.landmarks[landmark_index(person.bone.landmarks, name + side)]
            .position_mm;
      };
      options.metal_mm.push_back(0.65 * at("supra-M2") + 0.35 * at("infra-M2"));
    }
  } else {
    return fail(ErrorKind::usage, "flaw", "'" + std::string(word) + "' is not known",
                "use cropped-calvaria, cropped-nose, head-rest, table, metal or padding");
  }
  return {};
}

}  // namespace skullstation
