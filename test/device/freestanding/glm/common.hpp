#pragma once

#include <glm/vec2.hpp>
