#include "sensors/scan_pattern.h"
