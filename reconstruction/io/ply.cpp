#include "reconstruction/io/ply.h"
