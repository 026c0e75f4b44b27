// Stands in for CPython's header, which the pinned Box2D's b2Settings.h includes for its b2Assert:
// a failed assertion becomes a C++ exception that carries the asserted text.
#pragma once
#include <stdexcept>
#define PyErr_SetString(type, text) throw std::logic_error(text)
