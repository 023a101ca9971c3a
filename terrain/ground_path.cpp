#include "terrain/ground_path.h"
