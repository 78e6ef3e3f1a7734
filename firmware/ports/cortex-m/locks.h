/* How the main loop keeps the receive interrupt from running. */
#define VXD_LOCK() __asm volatile("cpsid i" ::: "memory")
#define VXD_UNLOCK() __asm volatile("cpsie i" ::: "memory")
