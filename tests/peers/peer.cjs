// Devices of the npm package "canopen" on a CAN bus behind a TCP bridge.
//
// node peer.cjs PORT, with frames as lines ID#DATA on the socket. Reads one JSON request
// [name, ...arguments] a line from its input and answers each with one line.

'use strict';

const net = require('net');
const readline = require('readline');
const { Device, Eds, DataType, ObjectType, AccessType } = require('canopen');

const TIMEOUT = 2000; // ms, of an SDO transfer
const socket = net.connect(Number(process.argv[2]), '127.0.0.1');
const devices = [];
const seen = { heartbeat: [], timeout: [], emergency: [], state: [] };

function join(device) {
    device.addListener('message', ({ id, data }) => {
        socket.write(`${id.toString(16)}#${data.toString('hex')}\n`);
    });
    device.nmt.addListener('heartbeat', ({ deviceId, state }) =>
        seen.heartbeat.push([deviceId, state]));
    device.nmt.addListener('timeout', (deviceId) => seen.timeout.push(deviceId));
    device.nmt.addListener('changeState', (state) => seen.state.push(state));
    device.emcy.addListener('emergency', ({ cobId, em }) =>
        seen.emergency.push([cobId, em.code, em.register]));
    devices.push(device);
}

readline.createInterface({ input: socket }).on('line', (line) => {
    const [id, data] = line.split('#');
    const message = { id: parseInt(id, 16), data: Buffer.from(data, 'hex') };
    message.len = message.data.length;
    for (const device of devices)
        device.receive(message);
});

const requests = {
    // A master with SDO client, heartbeat consumer and emergency consumer for one node.
    master(own, node, heartbeat) {
        const device = new Device({ eds: new Eds(), id: own });
        device.eds.addSdoClientParameter(node, 0x600 | node, 0x580 | node);
        device.eds.addHeartbeatConsumer(node, heartbeat);
        device.eds.addEmcyConsumer(0x80 | node);
        join(device);
        device.start();
        device.nmt.startNode();
        return true;
    },
    // A slave with objects of its own, whose EDS is written to a file.
    slave(own, file, heartbeat) {
        const eds = new Eds({ productName: 'peer', vendorNumber: 0x1234, productNumber: 7 });
        eds.addSdoServerParameter(0, 0x580 | own, 0x600 | own);
        eds.setHeartbeatProducerTime(heartbeat);
        const add = (index, name, type, access, value, more = {}) => {
            eds.addEntry(index, {
                parameterName: name,
                objectType: ObjectType.VAR,
                dataType: DataType[type],
                accessType: AccessType[access],
                ...more,
            }).value = value;
        };
        add(0x2000, 'small', 'UNSIGNED8', 'READ_WRITE', 17);
        add(0x2001, 'signed', 'INTEGER16', 'READ_WRITE', -1234);
        add(0x2002, 'word', 'UNSIGNED32', 'READ_ONLY', 0xDEADBEEF);
        add(0x2003, 'long', 'UNSIGNED64', 'READ_WRITE', 0x1122334455667788n);
        add(0x2004, 'bounded', 'UNSIGNED16', 'READ_WRITE', 5, { highLimit: 100 });
        add(0x2005, 'hidden', 'UNSIGNED16', 'WRITE_ONLY', 5);
        const device = new Device({ eds, id: own });
        join(device);
        device.start();
        eds.save(file);
        return true;
    },
    async read(node, index, sub) {
        const found = await devices[0].sdo.upload(
            { deviceId: node, index, subIndex: sub, timeout: TIMEOUT });
        return { hex: found.toString('hex') };
    },
    async write(node, index, sub, hex) {
        await devices[0].sdo.download(
            { deviceId: node, index, subIndex: sub, data: Buffer.from(hex, 'hex'),
                timeout: TIMEOUT });
        return { hex };
    },
    nmt(command, node) {
        devices[0].nmt[command](node);
        return true;
    },
    value(index) {
        return devices[0].eds.getEntry(index).value.toString();
    },
    seen() {
        return seen;
    },
};

const input = readline.createInterface({ input: process.stdin });
input.on('line', async (line) => {
    const [name, ...args] = JSON.parse(line);
    let answer;
    try {
        answer = await requests[name](...args);
    } catch (error) {
        answer = { abort: error.code === undefined ? null : error.code, words: String(error) };
    }
    console.log(JSON.stringify(answer));
});
input.on('close', () => process.exit(0));
socket.on('close', () => process.exit(0));
socket.on('connect', () => console.log('"ready"'));
