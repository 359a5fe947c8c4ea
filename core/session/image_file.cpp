#include "core/session/image_file.h"
