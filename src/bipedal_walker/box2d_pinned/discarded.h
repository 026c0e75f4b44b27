// For Box2D's process-wide counters: all threads would write them, and nobody reads them.
#pragma once

/// A place that lasts until the end of the expression.
template <class Number>
Number& discarded(Number&& place) {
  return place;
}
