/* A Modbus server on libmodbus whose measurement is the time of its sampling.

   clock_server tcp|PORT LAYOUT: prints the TCP port, or "ready". The value is 100 plus
   CLOCK_MONOTONIC in units of 0.1 ms modulo 900000, taken anew for each query, so that whoever reads
   a number knows when the server had it. The layouts are those of the makers' manuals:

   tlb      Laumas TLB: 6 status (bit 11 stable), 7-8 gross, 9-10 net, u32 high word first
   pt113    PT113: 0-1 net, 2 status (bit 1 valid), 5-6 gross, i32 high word first
   generic  0 status (bit 4 stable), 1-2 value, i32 high word first; also generic-length
   dsc      Mantracourt DSC: 3-4 status 0.0, 21-22 value, f32 low word first */

#include <arpa/inet.h>
#include <modbus.h>
#include <netinet/in.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include <time.h>

#define MODULUS 900000
#define OFFSET 100

static uint32_t counts(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return OFFSET + (uint32_t) (((uint64_t) now.tv_sec * 10000 + now.tv_nsec / 100000) % MODULUS);
}

static void high_first(uint16_t *at, uint32_t number)
{
    at[0] = number >> 16;
    at[1] = number & 0xFFFF;
}

static void sample(const char *layout, uint16_t *words)
{
    uint32_t number = counts();
    if (strcmp(layout, "tlb") == 0) {
        words[6] = 1 << 11;
        high_first(words + 7, number);
        high_first(words + 9, number);
    } else if (strcmp(layout, "pt113") == 0) {
        words[2] = 1 << 1;
        high_first(words, number);
        high_first(words + 5, number);
    } else if (strcmp(layout, "dsc") == 0) {
        float value = (float) number;
        uint32_t bits;
        memcpy(&bits, &value, sizeof bits);
        words[21] = bits & 0xFFFF;
        words[22] = bits >> 16;
    } else {
        words[0] = 1 << 4;
        high_first(words + 1, number);
    }
}

int main(int argc, char **argv)
{
    if (argc != 3)
        return 2;
    int tcp = strcmp(argv[1], "tcp") == 0;
    modbus_t *ctx = tcp ? modbus_new_tcp("127.0.0.1", 0) : modbus_new_rtu(argv[1], 115200, 'N', 8, 1);
    modbus_mapping_t *map = modbus_mapping_new(0, 0, 200, 0);
    uint8_t query[MODBUS_TCP_MAX_ADU_LENGTH];
    int listening = -1;

    modbus_set_slave(ctx, 1);
    if (tcp) {
        struct sockaddr_in address;
        socklen_t size = sizeof address;
        listening = modbus_tcp_listen(ctx, 1);
        getsockname(listening, (struct sockaddr *) &address, &size);
        printf("%d\n", ntohs(address.sin_port));
        fflush(stdout);
        modbus_tcp_accept(ctx, &listening);
    } else {
        if (modbus_connect(ctx) != 0)
            return 1;
        printf("ready\n");
        fflush(stdout);
    }
    for (;;) {
        int size = modbus_receive(ctx, query);
        if (size == -1 && tcp)
            return 0;
        if (size <= 0)
            continue;
        sample(argv[2], map->tab_registers);
        modbus_reply(ctx, query, size, map);
    }
}
