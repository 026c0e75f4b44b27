// Marks what the shared library shows. Everything else in it is hidden, the engines above all, so
// that another copy of an engine can live in the same process.
#pragma once

#define WALKER_SIM_EXPORT __attribute__((visibility("default")))
