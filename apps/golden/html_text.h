#pragma once

#include <string>
#include <string_view>

namespace groundray::golden {

/// Returns a text for HTML or SVG, where it may also be an attribute's value: special characters
/// become entities, control characters blanks.
std::string escaped(std::string_view text);

/// Returns a number for readers: whole numbers below 1e9 with all digits, others with five; "∞",
/// "not a number".
std::string number_text(double value);

/// Encodes bytes for a data URL.
/// @see RFC 4648, section 4.
std::string base64(std::string_view bytes);

}  // namespace groundray::golden
