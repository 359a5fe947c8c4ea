#include "firmware_io/motion_plan.h"
