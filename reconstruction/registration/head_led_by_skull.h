#pragma once

#include "reconstruction/registration/head_template.h"
#include "reconstruction/registration/skull_registration.h"

namespace skullstation {

/// Where the head's template lies if it goes along with its skull, #V x 3 in the frame of the fit
/// [mm]: a smoothing thin-plate spline (Bookstein 1989; Rohr et al. 2001) from the template's outer
/// bone to the fitted one. A start for register_head: skin that is led by bone doesn't take a lip
/// for a nose. Both templates must stem from the same anatomical frame.
Points3 head_led_by_skull(const HeadTemplate& head, const SkullTemplate& skull,
                          const FittedSkull& fit);

}  // namespace skullstation
