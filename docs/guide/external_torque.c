/* Prints the external torque of each joint, once a second: SOCKET [SECONDS]. */

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <time.h>

struct packet {
    uint64_t number, sequence, stamp_ns, published_ns, result;
    uint32_t joints, state, joint_outside, reserved;
    double torque[16], standard_deviation[16];
};

int main(int count, char **arguments)
{
    static const char *states[] = {
        "usable", "settling", "outside the identified motion", "no result",
    };
    struct sockaddr_un address = { .sun_family = AF_UNIX };
    if (count < 2 || strlen(arguments[1]) >= sizeof address.sun_path)
        return 2;
    strcpy(address.sun_path, arguments[1]);
    int client = socket(AF_UNIX, SOCK_SEQPACKET, 0);
    if (client < 0 || connect(client, (struct sockaddr *)&address, sizeof address) != 0) {
        perror(arguments[1]);
        return 1;
    }
    time_t end = count > 2 ? time(NULL) + atoi(arguments[2]) : 0, shown = 0;
    uint64_t following = 0, lost = 0;
    struct packet packet;
    while (recv(client, &packet, sizeof packet, 0) == sizeof packet) {
        if (following)
            lost += packet.number - following;
        following = packet.number + 1;
        time_t now = time(NULL);
        if (end && now > end)
            break;
        if (now == shown || packet.state > 3 || packet.joints > 16)
            continue;
        shown = now;
        printf("%s, %llu lost:", states[packet.state], (unsigned long long)lost);
        for (uint32_t joint = 0; joint < packet.joints; joint++)
            printf(" %.2f±%.2f", packet.torque[joint], packet.standard_deviation[joint]);
        printf("\n");
        fflush(stdout);
    }
    return 0;
}
