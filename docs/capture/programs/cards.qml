// Translucent cards and text of Qt Quick (Vulkan): QSG_RHI_BACKEND=vulkan qml cards.qml
import QtQuick
import QtQuick.Window

Window {
    width: 320; height: 240; visible: true; color: "#203040"
    Repeater {
        model: 12
        Rectangle {
            x: (index * 57) % 210; y: (index * 41) % 140
            width: 110; height: 90; radius: 18; rotation: index * 19
            color: Qt.hsla(index / 12, 0.8, 0.5, 0.45)
            border.color: "white"; border.width: 2; antialiasing: true
        }
    }
    Text {
        anchors.centerIn: parent; opacity: 0.7
        text: "screen door"; font.pixelSize: 44; color: "#ffff80"
    }
    Timer { interval: 1500; running: true; onTriggered: Qt.quit() }
    NumberAnimation on opacity { from: 1; to: 0.99; duration: 5000; loops: -1 }
}
