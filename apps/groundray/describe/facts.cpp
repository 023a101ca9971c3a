#include "apps/groundray/describe/facts.h"

#include <cstdio>

#include "core/io/print_error.h"

namespace groundray {

void print_facts(const Facts& facts) {
  for (const auto& [name, text] : facts) print_text(stdout, "{:<9} {}\n", name, text);
}

}  // namespace groundray
