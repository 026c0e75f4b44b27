// Replaces CPython's header, which the pinned Box2D's b2Settings.h includes for its b2Assert. A
// failed assertion throws a C++ exception with the asserted text.
#pragma once
#include <stdexcept>
#define PyErr_SetString(type, text) throw std::logic_error(text)
