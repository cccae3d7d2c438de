// A mutex whose holder runs at the priority of whoever waits for it.
#pragma once

#include <pthread.h>

#include <cassert>

namespace scan {

// Lets a thread that plays steps share state with threads of no priority: without inheritance a
// status query that is preempted while it holds the lock would make steps late.
class PriorityMutex {
 public:
  PriorityMutex() {
    pthread_mutexattr_t attributes;
    pthread_mutexattr_init(&attributes);
    pthread_mutexattr_setprotocol(&attributes, PTHREAD_PRIO_INHERIT);
    [[maybe_unused]] const int made = pthread_mutex_init(&mutex_, &attributes);
    assert(made == 0);
    pthread_mutexattr_destroy(&attributes);
  }
  ~PriorityMutex() { pthread_mutex_destroy(&mutex_); }
  PriorityMutex(const PriorityMutex&) = delete;
  PriorityMutex& operator=(const PriorityMutex&) = delete;

  void lock() { pthread_mutex_lock(&mutex_); }
  bool try_lock() { return pthread_mutex_trylock(&mutex_) == 0; }
  void unlock() { pthread_mutex_unlock(&mutex_); }

 private:
  pthread_mutex_t mutex_;
};

}  // namespace scan
