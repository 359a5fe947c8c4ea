#include "reconstruction/photogrammetry/poses.h"

namespace skullstation {

const char* to_string(ScaleSource source) {
  switch (source) {
    case ScaleSource::board: return "board";
    case ScaleSource::given_poses: return "given poses";
    case ScaleSource::unknown: break;
  }
  return "unknown";
}

}  // namespace skullstation
