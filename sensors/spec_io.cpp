#include "sensors/spec_io.h"
