#include "core/session/lens.h"
