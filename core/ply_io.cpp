#include "core/ply_io.h"
