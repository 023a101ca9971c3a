#include "terrain/dem_io.h"
