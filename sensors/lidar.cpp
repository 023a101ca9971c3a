#include "sensors/lidar.h"
