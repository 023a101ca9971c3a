#include "core/height_grid.h"
