/* A Modbus server on libmodbus, for the tests: a peer that winchkit shares no code with.

   argv[1] is "tcp" or the path of a serial port. Prints the TCP port. Holds a TLB's block, registers
   6 to 13: status, gross 12345, net -2500 (its sign in the status), peak, division. Register 5 taken
   as 7 sets the bit of the net value. */

#include <arpa/inet.h>
#include <modbus.h>
#include <netinet/in.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

int main(int argc, char **argv)
{
    int tcp = argc > 1 && strcmp(argv[1], "tcp") == 0;
    modbus_t *ctx = tcp ? modbus_new_tcp("127.0.0.1", 0) : modbus_new_rtu(argv[1], 115200, 'N', 8, 1);
    modbus_mapping_t *map = modbus_mapping_new(0, 0, 20, 0);
    uint8_t query[MODBUS_TCP_MAX_ADU_LENGTH];
    int listening = -1;

    map->tab_registers[3] = 815;
    map->tab_registers[6] = 1 << 11 | 1 << 8;
    map->tab_registers[8] = 12345;
    map->tab_registers[10] = 2500;
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
        if (size == -1 && tcp) {
            modbus_tcp_accept(ctx, &listening);
            continue;
        }
        if (size <= 0)
            continue;
        modbus_reply(ctx, query, size, map);
        if (map->tab_registers[5] == 7)
            map->tab_registers[6] |= 1 << 10;
    }
}
