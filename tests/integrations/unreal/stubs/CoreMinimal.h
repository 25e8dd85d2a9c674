// Stand-ins for what OccluderCuller uses of Unreal, on the standard library; the other headers here lead
// to this one.
#pragma once

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <map>
#include <string>
#include <vector>

using int32 = std::int32_t;
using uint8 = std::uint8_t;
using uint32 = std::uint32_t;

#define UCLASS()
#define GENERATED_BODY()
#define UPROPERTY(...)
#define TEXT(text) text
#define ANSI_TO_TCHAR(text) (text)
#define UTF8_TO_TCHAR(text) (text)
#define UE_LOG(category, verbosity, ...) (std::printf(#verbosity " "), std::printf(__VA_ARGS__), std::printf("\n"))

struct FString : std::string
{
    using std::string::string;
    FString(const std::string &text) : std::string(text) {}
    const char *operator*() const { return c_str(); }
};

template <typename Kind> struct TArray : std::vector<Kind>
{
    int32 Num() const { return static_cast<int32>(this->size()); }
    Kind *GetData() { return this->data(); }
    void SetNumZeroed(int32 count) { this->assign(static_cast<std::size_t>(count), Kind()); }
    Kind &operator[](int32 place) { return this->at(static_cast<std::size_t>(place)); }
};

template <typename Key, typename Value> struct TMap
{
    std::map<Key, Value> held;
    void Add(const Key &key, Value value) { held[key] = value; }
    Value *Find(const Key &key) { return held.count(key) ? &held[key] : nullptr; }
};

struct FVector
{
    double X, Y, Z;
};

// Yaw alone, in degrees: about the axis that points up.
struct FRotator
{
    double Yaw;
};

namespace EAxis
{
enum Type { X, Y, Z };
}

struct FMath
{
    static double DegreesToRadians(double value) { return value * 3.14159265358979323846 / 180.0; }
    static double RadiansToDegrees(double value) { return value * 180.0 / 3.14159265358979323846; }
    static double Tan(double value) { return std::tan(value); }
    static double Atan(double value) { return std::atan(value); }
};

struct FRotationMatrix
{
    double Turn;
    explicit FRotationMatrix(const FRotator &by) : Turn(FMath::DegreesToRadians(by.Yaw)) {}
    FVector GetUnitAxis(EAxis::Type axis) const
    {
        if (axis == EAxis::Z)
            return {0.0, 0.0, 1.0};
        return {std::cos(Turn), std::sin(Turn), 0.0};
    }
};

struct FPaths
{
    static FString ProjectContentDir() { return FString(); }
    static FString Combine(const FString &, const FString &file) { return file; }
};

struct FFileHelper
{
    static bool LoadFileToArray(TArray<uint8> &bytes, const char *path)
    {
        std::ifstream stream(path, std::ios::binary);
        bytes.assign(std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>());
        return !bytes.empty();
    }
};

struct APlayerCameraManager
{
    FVector Location;
    FRotator Rotation;
    float Fov;
    FVector GetCameraLocation() const { return Location; }
    FRotator GetCameraRotation() const { return Rotation; }
    float GetFOVAngle() const { return Fov; }
};

struct APlayerController
{
    APlayerCameraManager *PlayerCameraManager = nullptr;
};

class AActor;

struct UWorld
{
    std::vector<AActor *> Actors;
    APlayerController *Player = nullptr;
    APlayerController *GetFirstPlayerController() const { return Player; }
};

enum ETickingGroup { TG_PrePhysics, TG_PostUpdateWork };

class AActor
{
public:
    using Super = AActor;
    FString Name, Tag;
    UWorld *World = nullptr;
    bool bHidden = false, bTicks = true;
    struct
    {
        bool bCanEverTick = false;
        ETickingGroup TickGroup = TG_PrePhysics;
    } PrimaryActorTick;
    virtual ~AActor() {}
    virtual void BeginPlay() {}
    virtual void Tick(float) {}
    UWorld *GetWorld() const { return World; }
    FString GetName() const { return Name; }
    bool ActorHasTag(const char *tag) const { return Tag == tag; }
    void SetActorHiddenInGame(bool hidden) { bHidden = hidden; }
    void SetActorTickEnabled(bool ticks) { bTicks = ticks; }
};

template <typename Kind> struct TActorIterator
{
    UWorld *world;
    std::size_t place = 0;
    explicit TActorIterator(UWorld *in) : world(in) {}
    explicit operator bool() const { return place < world->Actors.size(); }
    Kind *operator*() const { return world->Actors[place]; }
    Kind *operator->() const { return world->Actors[place]; }
    void operator++() { ++place; }
};
