/* What the example needs of its surroundings: text out. */
#ifndef BOARD_H
#define BOARD_H

#include <stddef.h>
#include <stdint.h>

void say(const char *text);
void say_number(uint32_t number);
/* Bytes to standard output. */
void send(const void *bytes, size_t count);

#endif
