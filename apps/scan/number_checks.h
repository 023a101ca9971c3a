#pragma once

namespace CLI {
class Validator;
}

namespace groundray {

/// Returns a check for numbers above 0. Unlike that of CLI11, it rejects NaN and infinity.
CLI::Validator positive();

/// Returns a check for numbers of 0 or more, which also rejects NaN and infinity.
CLI::Validator not_negative();

/// Returns a check for whole numbers from 0 to 2^64 - 1. CLI11 itself takes -1 for the largest.
CLI::Validator whole();

}  // namespace groundray
