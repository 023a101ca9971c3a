#include "core/ray_tracer.h"
