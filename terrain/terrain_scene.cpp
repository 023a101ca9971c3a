#include "terrain/terrain_scene.h"
