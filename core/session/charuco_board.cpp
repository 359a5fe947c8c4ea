#include "core/session/charuco_board.h"
