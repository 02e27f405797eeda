/* The surroundings on the board mps2-an386 (Cortex-M4F) in QEMU: vectors, start-up, text and exit by semihosting. */
#include "board.h"

extern uint32_t stack_top, data_start, data_end, data_load, bss_start, bss_end;
int main(void);
void start(void);

/* The host carries out `operation` on `argument`. */
static uint32_t ask_host(uint32_t operation, const void *argument) {
    register uint32_t r0 __asm__("r0") = operation;
    register const void *r1 __asm__("r1") = argument;
    __asm__ volatile("bkpt 0xab" : "+r"(r0) : "r"(r1) : "memory");
    return r0;
}

void say(const char *text) { ask_host(0x04, text); }

void say_number(uint32_t number) {
    char text[11], *digit = text + sizeof text - 1;
    *digit = 0;
    do *--digit = (char)('0' + number % 10);
    while (number /= 10);
    say(digit);
}

/* The host's standard output is the file ":tt", opened for writing. */
void send(const void *bytes, size_t count) {
    static uint32_t handle;
    const uint32_t terminal[] = {(uint32_t)(uintptr_t)":tt", 4, 3};
    if (!handle) handle = ask_host(0x01, terminal);
    const uint32_t written[] = {handle, (uint32_t)(uintptr_t)bytes, count};
    ask_host(0x05, written);
}

/* Ends the emulator: 0x20026 is an exit of the application, all else an error. */
static void leave(int status) {
    ask_host(0x18, (const void *)(uintptr_t)(status ? 0x20023 : 0x20026));
    for (;;) {}
}

static void fault(void) { leave(1); }

void start(void) {
    *(volatile uint32_t *)0xe000ed88 |= 0xfu << 20; /* CPACR: the floating point unit, before any of its registers is touched */
    __asm__ volatile("dsb\n isb");
    for (uint32_t *to = &data_start, *from = &data_load; to < &data_end;) *to++ = *from++;
    for (uint32_t *to = &bss_start; to < &bss_end;) *to++ = 0;
    leave(main());
}

__attribute__((section(".vectors"), used)) static void *const vectors[] = {
    &stack_top, start, fault, fault, fault, fault, fault,
};
