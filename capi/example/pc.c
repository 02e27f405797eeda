/* The surroundings on a PC. */
#include "board.h"
#include <inttypes.h>
#include <stdio.h>

void say(const char *text) { fputs(text, stdout); }
void send(const void *bytes, size_t count) { fwrite(bytes, 1, count, stdout); }
void say_number(uint32_t number) { printf("%" PRIu32, number); }
