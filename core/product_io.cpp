#include "core/product_io.h"
