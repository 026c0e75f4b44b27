// Replaces Box2D's file with a timer that reads no clock. Box2D reads it a dozen times per step for
// unused profile data, and each read is a system call on many machines.
#include <Box2D/Common/b2Timer.h>

b2Timer::b2Timer() { Reset(); }

void b2Timer::Reset() {
  m_start_sec = 0;
  m_start_msec = 0;
}

float32 b2Timer::GetMilliseconds() const { return 0; }
