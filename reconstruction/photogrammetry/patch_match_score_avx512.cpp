// Compiled with the flags that this width needs; called only where the machine has it.
#if defined(__x86_64__)

#include <immintrin.h>

#include "reconstruction/photogrammetry/patch_match_lanes.h"

namespace skullstation {

namespace {

struct Gather {
  static constexpr int kWidth = 16;
  using Int = Lanes<16>::Int;
  [[gnu::always_inline]] static void load(const std::uint32_t* from, const Int& index, Int& out) {
    __m512i lanes;
    __builtin_memcpy(&lanes, &index, sizeof lanes);
    lanes = _mm512_mask_i32gather_epi32(_mm512_setzero_si512(), 0xffff, lanes, from, 4);
    __builtin_memcpy(&out, &lanes, sizeof lanes);
  }
};

}  // namespace

void score_avx512(const ScoreInput& in, float* costs) { score_with<Gather>(in, costs); }

}  // namespace skullstation

#endif
