#pragma once

namespace CLI {
class Validator;
}

namespace groundray {

/// Takes numbers above 0. Unlike CLI's own it refuses NaN and infinity.
CLI::Validator positive();

/// Takes numbers of 0 and more, likewise.
CLI::Validator not_negative();

}  // namespace groundray
