#include "reconstruction/photogrammetry/poses.h"

namespace skullstation {

const char* to_string(ScaleSource source) {
  switch (source) {
    case ScaleSource::board: return "board";
    case ScaleSource::given_poses: return "given poses";
    case ScaleSource::camera_radius: return "table angles and camera radius";
    case ScaleSource::unknown: break;
  }
  return "unknown";
}

Rigid3 PoseResult::table_from_board(int pass) const {
  for (const TableMotion& motion : table) {
    if (motion.pass == pass) return motion.table_from_board;
  }
  return {};
}

}  // namespace skullstation
