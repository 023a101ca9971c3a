#pragma once

namespace CLI {
class Validator;
}

namespace groundray {

/// Returns a check for numbers above 0. Unlike that of CLI11, it rejects NaN and infinity.
CLI::Validator positive();

/// Returns a check for numbers of 0 or more, which also rejects NaN and infinity.
CLI::Validator not_negative();

}  // namespace groundray
